import { ActionIcon, Menu, Tooltip } from "@mantine/core";
import { IconArrowsDiff, IconColumns3 } from "@tabler/icons-react";
import { useNavigate } from "@tanstack/react-router";
import { type PageSearch, roomSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import { compareSearch, ofDevice, Source } from "../sets/compare/specs";
import { useBenchOfTable, useDevice } from "./context";
import { useStaged } from "./staging";

const AGAINST = [
  Source.Left,
  Source.Found,
  Source.Delivered,
  Source.Golden,
  Source.Year,
  Source.Stored,
  Source.Default,
] as const;

/** From the parameters of a device to their comparison with what it held, or should hold. */
export function CompareMenu() {
  const t = useTexts();
  const { siblings } = useBenchOfTable();
  const { slug } = useDevice();
  const pending = [...useStaged().changes.values()].some((one) => one.device === slug);
  const navigate = useNavigate();
  const open = (own: PageSearch) =>
    void navigate({ to: "/sets", search: (before: PageSearch) => roomSearch(before, own) });
  const against = (source: Source) =>
    source === Source.Editor
      ? [ofDevice(Source.Live, slug), ofDevice(source, slug)]
      : [ofDevice(source, slug), ofDevice(Source.Live, slug)];
  return (
    <Menu position="bottom-start">
      <Menu.Target>
        <Tooltip label={t("page.compare.with")}>
          <ActionIcon aria-label={t("page.compare.with")} data-testid="compare-with">
            <IconArrowsDiff size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>{t("page.compare.with")}</Menu.Label>
        {[...(pending ? [Source.Editor] : []), ...AGAINST].map((source) => (
          <Menu.Item
            key={source}
            mih={40}
            title={t(`page.compare.hint.${source}`)}
            onClick={() => open(compareSearch(against(source)))}
            data-testid={`compare-with-${source}`}
          >
            {t(`page.compare.source.${source}`)}
          </Menu.Item>
        ))}
        {siblings.length > 1 && (
          <>
            <Menu.Divider />
            <Menu.Item
              mih={40}
              leftSection={<IconColumns3 size={17} aria-hidden />}
              onClick={() => open({ tab: "blades", device: slug })}
              data-testid="compare-blades"
            >
              {t("page.sets.tab.blades")}
            </Menu.Item>
          </>
        )}
      </Menu.Dropdown>
    </Menu>
  );
}
