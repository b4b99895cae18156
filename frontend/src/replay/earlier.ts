/** What the axes did before the cursor: plots that end at it have a past at once, wherever it was set. */
import { useQuery } from "@tanstack/react-query";
import { useEffect } from "react";
import { queryClient, useTurbineQuery } from "../api/queries";
import { type ReplayDoc, type SeriesLine, seriesQuery } from "../api/replay";
import { useBench, useStore } from "../live/live";
import { type Columns, KEPT_S } from "../live/trace";

const PMC = "oat-pmc";
const SETTLES_MS = 250;
const POINTS = 1500;
const POSITION = "6064";
const DEMAND = "607A";
const VELOCITY = "606C";
const CURRENT = "6078";
const STATUS = "6041";
const SIGNALS = [POSITION, DEMAND, VELOCITY, CURRENT, STATUS];
/** Operation enabled (CiA 402-2, 8.4.2). */
const STATE_MASK = 0x6f;
const ENABLED = 0x27;

export function useEarlier(doc: ReplayDoc): void {
  const store = useStore();
  const epoch = useBench()?.epoch;
  const stations = useQuery(useTurbineQuery()).data?.stations;
  useEffect(() => {
    const places = (stations ?? []).flatMap(({ blade, devices }) => {
      const pmc = devices.find((one) => one.description_id === PMC);
      return blade === null || !pmc ? [] : [{ blade, slug: pmc.slug }];
    });
    const ending = new AbortController();
    const fill = async () => {
      const toNs = store.serverNowMs() * 1e6;
      const fromNs = Math.max(doc.from_ns, toNs - KEPT_S * 1e9);
      if (places.length === 0 || toNs - fromNs < 1e6) return;
      const signals = places.flatMap(({ slug }) => SIGNALS.map((address) => `${slug}/${address}`));
      const asked = { signals, fromNs, toNs, points: POINTS };
      const lines = await queryClient.query(seriesQuery(doc.id, asked));
      if (ending.signal.aborted) return;
      for (const { blade, slug } of places)
        store.fillTrace(
          blade,
          columnsOf(
            lines.filter((one) => one.device === slug),
            doc.from_ns / 1e9,
          ),
        );
    };
    // Who drags the cursor wants its past where it comes to rest. Without an index there is none.
    const timer = setTimeout(() => void fill().catch(() => undefined), SETTLES_MS);
    return () => {
      ending.abort();
      clearTimeout(timer);
    };
  }, [store, epoch, stations, doc.id, doc.from_ns]);
}

/** Lines of one axis by the times of its position; of a bucket least and greatest are two samples. */
export function columnsOf(lines: readonly SeriesLine[], startS: number): Columns {
  const of = (address: string) => lines.find((one) => one.address === address);
  const position = of(POSITION);
  const columns: Columns = { times: [], positions: [], demands: [], velocities: [], currents: [] };
  if (!position) return columns;
  const [demand, velocity, current, status] = [of(DEMAND), of(VELOCITY), of(CURRENT), of(STATUS)].map(
    (line) => line && new Follower(line),
  );
  const stepS = position.exact ? 0 : position.bucket_s / 2;
  position.t_s.forEach((atS, index) => {
    const untilS = atS + position.bucket_s;
    for (const side of position.exact ? (["low"] as const) : (["low", "high"] as const)) {
      const enabled = status === undefined || isEnabled(status.at(untilS, "low"), status.at(untilS, "high"));
      columns.times.push(startS + atS + (side === "high" ? stepS : 0));
      columns.positions.push(position[side][index] ?? null);
      columns.demands.push(enabled ? (demand?.at(untilS, side) ?? null) : null);
      columns.velocities.push(velocity?.at(untilS, side) ?? null);
      columns.currents.push(current?.at(untilS, side) ?? null);
    }
  });
  return columns;
}

const isEnabled = (low: number | null, high: number | null): boolean =>
  [low, high].every((raw) => raw !== null && (raw & STATE_MASK) === ENABLED);

/** What a line last told, asked for in the order of time. */
class Follower {
  private index = -1;
  private readonly line: SeriesLine;

  constructor(line: SeriesLine) {
    this.line = line;
  }

  at(timeS: number, side: "low" | "high"): number | null {
    const { t_s } = this.line;
    while (this.index + 1 < t_s.length && (t_s[this.index + 1] ?? Infinity) <= timeS) this.index += 1;
    return this.line[side][this.index] ?? null;
  }
}
