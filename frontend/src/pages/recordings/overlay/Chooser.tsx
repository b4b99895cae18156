import { Button, Checkbox, Select } from "@mantine/core";
import { IconListSearch } from "@tabler/icons-react";
import { useMutation, useQueries, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { recordingsQuery } from "../../../api/files";
import { incidentsQuery } from "../../../api/incidents";
import { makeIndex, overlayKeys, tripsOfQuery } from "../../../api/overlay";
import { queryClient } from "../../../api/queries";
import type { TripsDoc } from "../../../api/replay";
import { digitsOf } from "../../../api/trace";
import type { RecordingRef } from "../../../api/types";
import { replayOfFile } from "../../../replay/leaving";
import { useTexts } from "../../../texts/texts";
import { dateAndTime, timeOfDay } from "../../../ui/format";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import type { Zero } from "./choice";
import classes from "./Overlay.module.css";
import { useMoments } from "./moments";

interface Props {
  zeros: readonly Zero[];
  onChange: (zeros: readonly Zero[]) => void;
}

interface Listed {
  file: RecordingRef;
  name: string;
  /** Undefined as long as they are not known. */
  trips: TripsDoc | undefined;
  /** It has no index yet. */
  missing: boolean;
}

/** All recordings, those with trips first, each with its zero. */
export function Chooser({ zeros, onChange }: Props) {
  const t = useTexts();
  const list = useQuery(recordingsQuery);
  const [filter, setFilter] = useState("");
  const files = (list.data?.files ?? []).filter(
    ({ state }) => state === "finished" || state === "unfinished" || state === "unread",
  );
  const trips = useQueries({ queries: files.map(({ name }) => tripsOfQuery(name)) });
  const rows: Listed[] = files.map((file, at) => ({
    file,
    name: replayOfFile(file.name),
    trips: trips[at]?.data,
    missing: trips[at]?.isError ?? false,
  }));
  const rank = ({ trips: known }: Listed) => (known === undefined ? 1 : known.trips.length > 0 ? 0 : 2);
  const wanted = filter.toLowerCase();
  const shown = rows
    .filter(({ file }) => `${file.name} ${file.summary?.turbine ?? ""}`.toLowerCase().includes(wanted))
    .toSorted((a, b) => rank(a) - rank(b));
  const put = (name: string, zero: Zero | null) => {
    const others = zeros.filter((one) => one.name !== name);
    const at = zeros.findIndex((one) => one.name === name);
    onChange(zero === null ? others : at < 0 ? [...zeros, zero] : zeros.with(at, zero));
  };
  return (
    <section className={classes.chooser} aria-label={t("page.overlay.recordings")}>
      <input
        className={classes.filter}
        value={filter}
        onChange={(event) => setFilter(event.currentTarget.value)}
        placeholder={t("page.overlay.filter")}
        aria-label={t("page.overlay.filter")}
      />
      {list.isError && <ProblemAlert error={list.error} title={t("page.recordings.failed")} />}
      <ul>
        {shown.map((one) => (
          <Row
            key={one.name}
            listed={one}
            zero={zeros.find(({ name }) => name === one.name) ?? null}
            at={zeros.findIndex(({ name }) => name === one.name)}
            onChange={(zero) => put(one.name, zero)}
          />
        ))}
      </ul>
    </section>
  );
}

interface RowProps {
  listed: Listed;
  zero: Zero | null;
  /** Its place among the chosen ones; -1 where it is not. */
  at: number;
  onChange: (zero: Zero | null) => void;
}

function Row({ listed, zero, at, onChange }: RowProps) {
  const t = useTexts();
  const { file, name, trips, missing } = listed;
  const startNs = file.summary?.first_ns ?? file.summary?.started_ns ?? null;
  const first: Zero | null =
    trips && trips.trips.length > 0
      ? { name, trip: 0, tNs: null }
      : startNs === null
        ? null
        : { name, trip: null, tNs: digitsOf(startNs) };
  const facts = [
    file.summary?.turbine.toUpperCase() ?? "",
    startNs === null ? "" : dateAndTime(startNs / 1e6),
    trips && t("page.overlay.trips", { count: trips.trips.length }),
  ];
  return (
    <li className={classes.row} data-chosen={zero !== null}>
      <Checkbox
        checked={zero !== null}
        disabled={first === null && zero === null}
        onChange={(event) => onChange(event.currentTarget.checked ? first : null)}
        label={
          <span className={classes.file}>
            {at >= 0 && (
              <i className={classes.dot} style={{ background: `var(--overlay-${at % 8})` }} aria-hidden />
            )}
            {name}
          </span>
        }
        description={facts.filter(Boolean).join(" · ")}
        data-testid={`overlay-${name}`}
      />
      {missing && trips === undefined && <Indexing name={name} />}
      {zero !== null && (
        <ZeroSelect zero={zero} file={file} trips={trips} startNs={startNs} onChange={onChange} />
      )}
    </li>
  );
}

/** Without an index no trips are known and no curves can be drawn. */
function Indexing({ name }: { name: string }) {
  const t = useTexts();
  const making = useMutation({
    mutationFn: () => makeIndex(name),
    onSettled: () => queryClient.invalidateQueries(overlayKeys),
  });
  const failed = making.data?.state === "failed";
  return (
    <>
      <Button
        variant="subtle"
        px="xs"
        leftSection={<IconListSearch size={16} aria-hidden />}
        loading={making.isPending}
        onClick={() => making.mutate()}
        title={t("page.overlay.index_why")}
        data-testid={`index-${name}`}
      >
        {t("page.overlay.index")}
      </Button>
      {making.isError && <ProblemAlert error={making.error} title={t("page.overlay.index_failed")} />}
      {failed && <p className="tone-error">{t("page.overlay.index_failed")}</p>}
    </>
  );
}

interface ZeroProps {
  zero: Zero;
  file: RecordingRef;
  trips: TripsDoc | undefined;
  startNs: number | null;
  onChange: (zero: Zero) => void;
}

/** What is laid over zero: a trip, something that was marked, the cursor of its replay, or its beginning. */
function ZeroSelect({ zero, file, trips, startNs, onChange }: ZeroProps) {
  const t = useTexts();
  const { name } = zero;
  const moments = useMoments(file.name, name, useQuery(incidentsQuery).data ?? []);
  const options = [
    ...(trips?.trips ?? []).map((trip) => ({
      value: `~${trip.number}`,
      label: t("page.overlay.zero.trip", {
        number: trip.number + 1,
        time: timeOfDay(trip.t0_ns / 1e6),
        says: trip.headline[t.language],
      }),
    })),
    ...moments.map(({ tNs, label }) => ({ value: `@${digitsOf(tNs)}`, label })),
    ...(startNs === null ? [] : [{ value: `@${digitsOf(startNs)}`, label: t("page.overlay.zero.start") }]),
  ];
  const own = zero.trip === null ? `@${zero.tNs ?? ""}` : `~${zero.trip}`;
  const label =
    zero.trip === null
      ? t("page.overlay.zero.moment", { time: timeOfDay(Number(zero.tNs) / 1e6) })
      : t("page.overlay.zero.number", { number: zero.trip + 1 });
  const distinct = new Map([{ value: own, label }, ...options].map((one) => [one.value, one]));
  const choose = (value: string | null) => {
    if (value === null) return;
    const at = value.slice(1);
    onChange(value.startsWith("~") ? { name, trip: Number(at), tNs: null } : { name, trip: null, tNs: at });
  };
  return (
    <Select
      aria-label={t("page.overlay.zero.label", { name })}
      value={own}
      onChange={choose}
      data={[...distinct.values()]}
      allowDeselect={false}
      comboboxProps={{ width: 420, position: "bottom-start" }}
      data-testid={`zero-${name}`}
    />
  );
}
