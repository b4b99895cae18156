/** Whose blades are compared, and of when: of the connected turbine now, or of any turbine by its latest sets. */
import { useQuery } from "@tanstack/react-query";
import { LEAST_COLUMNS, parityQuery, type ParityPart } from "../../../api/compare";
import { turbineQuery } from "../../../api/queries";
import { type KnownTurbine, knownTurbinesQuery } from "../../../api/settings";
import { usePageSearch } from "../../../frame/search";
import { placesOf } from "../../../ui/devices";
import { kindsOf } from "../../parameters/selection";
import { ofDevice, Source } from "../compare/specs";

/** One kind of device at several blades. */
export interface BladeKind {
  descriptionId: string;
  name: string;
  columns: readonly string[];
  devices: readonly string[];
  /** Blades of which no set is kept. */
  without: readonly number[];
}

export interface Parity {
  turbines: readonly KnownTurbine[];
  /** undefined: none is connected, and there are several or none to choose from. */
  turbine: string | undefined;
  connected: boolean;
  source: Source.Live | Source.Latest;
  kinds: readonly BladeKind[];
  settled: boolean;
  error: unknown;
}

export function useParity(): Parity {
  const [search] = usePageSearch();
  const here = useQuery(turbineQuery);
  const known = useQuery(knownTurbinesQuery);
  const turbines = (known.data ?? []).filter(
    ({ slug, blades }) => blades >= LEAST_COLUMNS || slug === (search.turbine ?? here.data?.slug),
  );
  const turbine =
    search.turbine ?? here.data?.slug ?? (turbines.length === 1 ? turbines[0]?.slug : undefined);
  const connected = turbine !== undefined && turbine === here.data?.slug;
  const source = connected && search.of !== Source.Latest ? Source.Live : Source.Latest;
  const latest = useQuery(parityQuery(here.isSuccess && source === Source.Latest ? turbine : undefined));
  const live = kindsOf(placesOf(here.data))
    .filter((kind) => kind.places.length >= LEAST_COLUMNS)
    .map((kind) => ({
      descriptionId: kind.descriptionId,
      name: kind.name,
      columns: kind.places.map((place) => ofDevice(Source.Live, place.device.slug)),
      devices: kind.places.map((place) => place.device.slug),
      without: [],
    }));
  const kept = source === Source.Latest;
  return {
    turbines,
    turbine,
    connected,
    source,
    kinds: kept ? (latest.data?.parts ?? []).map(kindOf) : live,
    settled: here.isSuccess && known.isSuccess && (!kept || turbine === undefined || !latest.isPending),
    error: kept ? latest.error : null,
  };
}

export function kindOf({ description_id, comparison, without }: ParityPart): BladeKind {
  const devices = comparison.columns.map((one) => one.device);
  return {
    descriptionId: description_id,
    name: devices[0]?.split("/").at(-1)?.toUpperCase() ?? description_id,
    columns: comparison.columns.map((one) => one.spec),
    devices,
    without,
  };
}
