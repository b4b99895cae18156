/** Which golden set the fleet is held against, as the URL holds it: `oat-pmc`, or `oat-pmc:RECORD`. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { recordsQuery } from "../../../api/compare";
import { turbineQuery } from "../../../api/queries";
import { placesOf } from "../../../ui/devices";
import { kindsOf } from "../../parameters/selection";

export interface KindChoice {
  id: string;
  name: string;
}

export interface Golden {
  /** Id of the description; empty while none is known. */
  kind: string;
  /** null: the set that is marked golden. */
  record: string | null;
}

export function goldenOf(text: string | undefined, kinds: readonly KindChoice[]): Golden {
  const [kind = "", record = ""] = (text ?? "").split(":");
  return { kind: kind === "" ? (kinds[0]?.id ?? "") : kind, record: record === "" ? null : record };
}

export const goldenText = ({ kind, record }: Golden): string =>
  record === null ? kind : `${kind}:${record}`;

/** Enough of the latest sets to know of which kinds there are any. */
const LOOKED_AT = 300;

/** The kinds of devices that are known: of the connected turbine first, then of the library. */
export function useKinds(): KindChoice[] {
  const turbine = useQuery(turbineQuery).data;
  const records = useQuery(recordsQuery(null, LOOKED_AT)).data;
  return useMemo(() => {
    const kinds = kindsOf(placesOf(turbine)).map(({ descriptionId, name }) => ({ id: descriptionId, name }));
    const others = new Set(records?.map((one) => one.description_id));
    for (const { id } of kinds) others.delete(id);
    return [...kinds, ...[...others].map((id) => ({ id, name: id }))];
  }, [turbine, records]);
}
