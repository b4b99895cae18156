import { SegmentedControl, Select } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import type { FaultKind } from "../../api/instructor";
import { turbineQuery } from "../../api/queries";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import type { Place } from "./draft";
import classes from "./Instructor.module.css";
import type { NodeChoice } from "./names";

const WHOLE = "all";
const SHARE = "percent";
const BLADES = ["1", "2", "3"];

/** Where the URL says that the fault is to go, as far as this kind can go there; null while no node is known. */
export function usePlace(kind: FaultKind, nodes: readonly NodeChoice[]): Place | null {
  const [search] = usePageSearch();
  const blade = BLADES.includes(search.blade ?? "") ? Number(search.blade) : null;
  switch (kind.target) {
    case "turbine":
      return { blade, node: null };
    case "blade":
      return { blade: blade ?? 1, node: null };
    case "bus":
      return { blade: null, node: nodes.find((one) => String(one.node) === search.node)?.node ?? null };
    case "node": {
      const chosen =
        nodes.find((one) => String(one.node) === search.node) ??
        nodes.find((one) => one.slug === search.device) ??
        nodes[0];
      return chosen ? { blade: null, node: chosen.node } : null;
    }
  }
}

interface Props {
  kind: FaultKind;
  nodes: readonly NodeChoice[];
  place: Place | null;
}

/** The chooser that fits the kind: a blade, the whole turbine, a device, or all that is on the bus. */
export function Target({ kind, nodes, place }: Props) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const label = t(`page.instructor.target.${kind.target}`);
  if (kind.target === "turbine" || kind.target === "blade") {
    const whole = { value: WHOLE, label: t("page.instructor.whole_turbine") };
    const blades = BLADES.map((blade) => ({ value: blade, label: t("page.blade", { blade }) }));
    return (
      <div className={classes.target}>
        <span className={classes.label}>{label}</span>
        <SegmentedControl
          className={classes.segments ?? ""}
          data={kind.target === "turbine" ? [whole, ...blades] : blades}
          value={place?.blade == null ? WHOLE : String(place.blade)}
          onChange={(blade) => update({ blade: blade === WHOLE ? undefined : blade })}
          aria-label={label}
          data-testid="target"
        />
      </div>
    );
  }
  // What no share of the frames can be given for acts on the bus as a whole.
  if (kind.target === "bus" && !kind.parameters.some(({ name }) => name === SHARE)) return null;
  return <NodeSelect kind={kind} nodes={nodes} place={place} label={label} />;
}

function NodeSelect({ kind, nodes, place, label }: Props & { label: string }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const connected = useQuery(turbineQuery).data !== undefined;
  const all = kind.target === "bus" ? [{ value: WHOLE, label: t("page.instructor.all_nodes") }] : [];
  return (
    <Select
      className={classes.target ?? ""}
      w={300}
      label={label}
      data={[
        ...all,
        ...nodes.map((one) => ({
          value: String(one.node),
          label: t("page.instructor.device_node", { name: one.name, node: one.node }),
        })),
      ]}
      value={place === null ? null : place.node === null ? WHOLE : String(place.node)}
      onChange={(node) => update({ node: node === WHOLE || node === null ? undefined : node })}
      error={connected ? undefined : t("page.instructor.connect_first")}
      allowDeselect={false}
      searchable
      data-testid="target"
    />
  );
}
