import { SegmentedControl, Select } from "@mantine/core";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { Source } from "../compare/specs";
import type { BladeKind, Parity } from "./useParity";

const LABEL = { minHeight: 40, display: "flex", alignItems: "center", justifyContent: "center" };

/** Which turbine, of when, and which kind of device; what leaves no choice is not there. */
export function Chooser({ parity, kind }: { parity: Parity; kind?: BladeKind }) {
  const { turbines, turbine, connected, source, kinds } = parity;
  const t = useTexts();
  const [, update] = usePageSearch();
  const pickKind = (id: string) => {
    const next = kinds.find((one) => one.descriptionId === id);
    update({ device: next?.devices[0], group: undefined, edit: undefined });
  };
  const pickTurbine = (slug: string | null) =>
    update({ turbine: slug ?? undefined, of: undefined, group: undefined, edit: undefined });
  return (
    <>
      {(turbines.length > 1 || !connected) && (
        <Select
          aria-label={t("page.parity.turbine")}
          placeholder={t("page.parity.turbine")}
          w={130}
          searchable
          allowDeselect={false}
          data={turbines.map((one) => ({ value: one.slug, label: one.name }))}
          value={turbine ?? null}
          onChange={pickTurbine}
          data-testid="parity-turbine"
        />
      )}
      {connected && (
        <SegmentedControl
          aria-label={t("page.parity.of.label")}
          size="sm"
          styles={{ label: LABEL }}
          data={[Source.Live, Source.Latest].map((value) => ({ value, label: t(`page.parity.of.${value}`) }))}
          value={source}
          onChange={(next) => update({ of: next === Source.Latest ? next : undefined })}
          data-testid="parity-of"
        />
      )}
      {kind && kinds.length > 1 && (
        <SegmentedControl
          aria-label={t("page.device.kind")}
          size="sm"
          styles={{ label: LABEL }}
          data={kinds.map((one) => ({ value: one.descriptionId, label: one.name }))}
          value={kind.descriptionId}
          onChange={pickKind}
          data-testid="parity-kind"
        />
      )}
    </>
  );
}
