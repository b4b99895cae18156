import { SegmentedControl, Select } from "@mantine/core";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { type Golden, goldenText, type KindChoice } from "./golden";
import { useGoldenChoices } from "./useGoldenChoices";

const LABEL = { minHeight: 40, display: "flex", alignItems: "center", justifyContent: "center" };
const MARKED = "";

/** First the kind of device, then the set: the one marked golden, or any other of the kind. */
export function GoldenPicker({ kinds, kind, record }: { kinds: readonly KindChoice[] } & Golden) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const choices = useGoldenChoices(kind);
  const pick = (golden: Golden) => update({ golden: goldenText(golden), group: undefined, order: undefined });
  return (
    <>
      {kinds.length > 1 && (
        <SegmentedControl
          aria-label={t("page.device.kind")}
          size="sm"
          styles={{ label: LABEL }}
          data={kinds.map((one) => ({ value: one.id, label: one.name }))}
          value={kind}
          onChange={(id) => pick({ kind: id, record: null })}
          data-testid="fleet-kind"
        />
      )}
      <Select
        aria-label={t("page.fleet.golden")}
        w={330}
        searchable
        allowDeselect={false}
        data={[{ value: MARKED, label: t("page.fleet.marked") }, ...choices]}
        value={record ?? MARKED}
        onChange={(id) => pick({ kind, record: id === null || id === MARKED ? null : id })}
        nothingFoundMessage={t("page.compare.picker.none")}
        data-testid="fleet-golden"
      />
    </>
  );
}
