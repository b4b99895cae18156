import { Button, Menu } from "@mantine/core";
import { IconArrowDown, IconArrowsVertical, IconArrowUp } from "@tabler/icons-react";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";

const WAYS = [
  { dir: undefined, name: "any", Icon: IconArrowsVertical },
  { dir: "rx", name: "rx", Icon: IconArrowDown },
  { dir: "tx", name: "tx", Icon: IconArrowUp },
] as const;

/** Which way the frames went that are shown: to us, from us, or both. */
export function Direction() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const chosen = WAYS.find((way) => way.dir === search.dir) ?? WAYS[0];
  return (
    <Menu position="bottom-start">
      <Menu.Target>
        <Button
          variant={chosen.dir === undefined ? "default" : "light"}
          px="sm"
          leftSection={<chosen.Icon size={17} aria-hidden />}
          aria-label={`${t("trace.page.direction")}: ${t(`trace.page.direction_${chosen.name}`)}`}
          data-testid="trace-dir"
        >
          {t(`trace.page.direction_${chosen.name}`)}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {WAYS.map(({ dir, name, Icon }) => (
          <Menu.Item
            key={name}
            mih={40}
            role="menuitemradio"
            aria-checked={chosen.name === name}
            leftSection={<Icon size={17} aria-hidden />}
            onClick={() => update({ dir })}
            data-testid={`trace-dir-${name}`}
          >
            {t(`trace.page.direction_${name}`)}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}
