/** The filter of the trace as it stands in the URL. */
import type { TraceFilter } from "../../api/trace";
import type { PageSearch } from "../../frame/search";

/** Services as people speak of them, each with those that it stands for. */
export const GROUPS: Record<string, readonly string[]> = {
  sdo: ["sdo-request", "sdo-response"],
  pdo: ["tpdo", "rpdo"],
  nmt: ["nmt"],
  heartbeat: ["heartbeat"],
  emcy: ["emcy"],
  sync: ["sync", "time"],
  modbus: ["modbus-request", "modbus-response"],
  profibus: ["fdl-request", "fdl-response"],
  cyclic: ["fdl-same", "fdl-token"],
  other: ["lss", "error", "twin", "unknown"],
};

export const listOf = (text: string | undefined): string[] => (text ?? "").split(",").filter(Boolean);

export function filterOf(search: PageSearch): TraceFilter {
  return {
    nodes: listOf(search.nodes).map(Number).filter(Number.isInteger),
    services: listOf(search.services).flatMap((group) => GROUPS[group] ?? [group]),
    direction: search.dir === "rx" || search.dir === "tx" ? search.dir : null,
    ids: search.ids ?? "",
    data: search.data ?? "",
    q: search.q ?? "",
    errors: search.errors !== undefined,
  };
}

export function isFiltered(search: PageSearch): boolean {
  const { nodes, services, dir, ids, data, q, errors } = search;
  return [nodes, services, dir, ids, data, q, errors].some((part) => part !== undefined);
}

/** A table without its filter, order and choice of columns. */
export const NO_VIEW = { find: undefined, order: undefined, less: undefined } as const;

export const NO_FILTER = {
  nodes: undefined,
  services: undefined,
  dir: undefined,
  ids: undefined,
  data: undefined,
  q: undefined,
  errors: undefined,
} as const;
