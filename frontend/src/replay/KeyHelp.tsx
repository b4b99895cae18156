import { ActionIcon, Popover, Tooltip } from "@mantine/core";
import { IconKeyboard } from "@tabler/icons-react";
import { useTexts } from "../texts/texts";
import { KEYS } from "./keys";
import classes from "./Replay.module.css";

/** The keys of a replay, behind a button and the question mark. */
export function KeyHelp({ opened, onChange }: { opened: boolean; onChange: (opened: boolean) => void }) {
  const t = useTexts();
  const label = t("page.replay.help");
  return (
    <Popover opened={opened} onChange={onChange} position="bottom-end" withArrow trapFocus={false}>
      <Popover.Target>
        <Tooltip label={label}>
          <ActionIcon
            aria-label={label}
            aria-expanded={opened}
            onClick={() => onChange(!opened)}
            data-testid="replay-help"
          >
            <IconKeyboard size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Popover.Target>
      <Popover.Dropdown aria-label={label}>
        <dl className={classes.keys} data-testid="replay-keys">
          {KEYS.map(({ name, keys }) => (
            <div key={name}>
              <dt>
                {keys.map((key) => (
                  <kbd key={key}>
                    {t.has(`page.replay.key.${key.toLowerCase()}`)
                      ? t(`page.replay.key.${key.toLowerCase()}`)
                      : key}
                  </kbd>
                ))}
              </dt>
              <dd>{t(`page.replay.keys.${name}`)}</dd>
            </div>
          ))}
        </dl>
        <p className={classes.hint}>{t("page.replay.timeline_hint")}</p>
      </Popover.Dropdown>
    </Popover>
  );
}
