import { ActionIcon, Menu, Tooltip, UnstyledButton } from "@mantine/core";
import { IconChevronDown, IconMinus, IconPlus } from "@tabler/icons-react";
import type { CursorData } from "../api/types";
import { localise } from "../model/values";
import { useTexts } from "../texts/texts";
import classes from "./Replay.module.css";
import { speedBeside, SPEEDS, type Transport } from "./transport";

/** Less than this share off is as fast as asked for. */
const OFF = 0.05;

/** How fast it plays: what was asked for, and what is really attained where that is another. */
export function Speed({ cursor, transport }: { cursor: CursorData; transport: Transport }) {
  const t = useTexts();
  const times = (speed: number) => t("page.replay.times", { speed: localise(String(speed), t.language) });
  const { speed, attained, playing } = cursor;
  const slow = playing && attained !== null && Math.abs(attained / speed - 1) > OFF;
  const label = t("page.replay.speed_now", { speed: times(speed) });
  return (
    <div className={classes.speed} role="group" aria-label={t("page.replay.speed")}>
      <Beside
        name="slower"
        icon={<IconMinus size={16} />}
        on={() => transport.setSpeed(speedBeside(speed, false))}
      />
      <Menu position="bottom-start">
        <Menu.Target>
          <UnstyledButton className={classes.speedNow} aria-label={label} data-testid="speed">
            <span>
              <b>{times(speed)}</b>
              {slow && (
                <small data-testid="attained">
                  {t("page.replay.attained", { speed: times(Number(attained.toPrecision(2))) })}
                </small>
              )}
            </span>
            <IconChevronDown size={15} aria-hidden />
          </UnstyledButton>
        </Menu.Target>
        <Menu.Dropdown>
          <Menu.Label>{t("page.replay.speed")}</Menu.Label>
          {SPEEDS.map((one) => (
            <Menu.Item
              key={one}
              mih={36}
              fw={one === speed ? 700 : 400}
              onClick={() => transport.setSpeed(one)}
              data-testid={`speed-${one}`}
            >
              {times(one)}
            </Menu.Item>
          ))}
        </Menu.Dropdown>
      </Menu>
      <Beside
        name="faster"
        icon={<IconPlus size={16} />}
        on={() => transport.setSpeed(speedBeside(speed, true))}
      />
    </div>
  );
}

function Beside({ name, icon, on }: { name: string; icon: React.ReactNode; on: () => void }) {
  const t = useTexts();
  const label = t(`page.replay.${name}`);
  return (
    <Tooltip label={label}>
      <ActionIcon aria-label={label} onClick={on} data-testid={name}>
        {icon}
      </ActionIcon>
    </Tooltip>
  );
}
