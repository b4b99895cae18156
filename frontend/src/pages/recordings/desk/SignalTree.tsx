import { CloseButton, TextInput } from "@mantine/core";
import { IconChevronDown, IconChevronRight, IconFilter } from "@tabler/icons-react";
import { type KeyboardEvent, useDeferredValue, useMemo, useState } from "react";
import { useWatchDevice } from "../../../live/live";
import { figure } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import classes from "./Desk.module.css";
import { startDrag } from "./drag";
import { AtCursor } from "./Legend";
import type { DeskSignal } from "./signals";
import type { Plots } from "./usePlots";
import { VirtualList } from "./VirtualList";

const ROW_PX = 30;

type Row =
  | { kind: "device" | "group"; id: string; title: string; count: number; open: boolean; depth: number }
  | { kind: "signal"; id: string; signal: DeskSignal; shown: boolean };

interface Props {
  signals: ReadonlyMap<string, DeskSignal>;
  plots: Plots;
}

/** Everything that crossed the wire, device by device and group by group; dragged into a plot, or put there by Enter. */
export function SignalTree({ signals, plots }: Props) {
  const t = useTexts();
  const [typed, setTyped] = useState("");
  // The letter first, then the rows.
  const wanted = useDeferredValue(typed);
  const [opened, setOpened] = useState<ReadonlySet<string>>(() => new Set());
  const shown = useMemo(() => new Set(plots.list.flatMap((plot) => plot.signals)), [plots.list]);
  const found = useMemo(() => matching(signals, wanted), [signals, wanted]);
  const rows = useMemo(() => rowsOf(found, wanted !== "", opened, shown), [found, wanted, opened, shown]);
  const devices = useMemo(
    () => [...new Set(rows.flatMap((row) => (row.kind === "signal" ? row.signal.line.device : [])))],
    [rows],
  );
  const toggleBranch = (id: string) =>
    setOpened((before) => {
      const after = new Set(before);
      if (!after.delete(id)) after.add(id);
      return after;
    });
  const pick = (row: Row) => (row.kind === "signal" ? plots.toggle(row.signal) : toggleBranch(row.id));
  const onKey = (event: KeyboardEvent, row: Row) => {
    if (row.kind === "signal" || !["ArrowLeft", "ArrowRight"].includes(event.key)) return false;
    if (row.open !== (event.key === "ArrowRight")) toggleBranch(row.id);
    return true;
  };
  return (
    <>
      {devices.map((slug) => (
        <Watched key={slug} slug={slug} />
      ))}
      <div className={classes.filter}>
        <TextInput
          aria-label={t("desk.find_signal")}
          placeholder={t("desk.find_signal")}
          leftSection={<IconFilter size={17} aria-hidden />}
          rightSectionWidth={40}
          rightSection={
            typed !== "" && (
              <CloseButton aria-label={t("page.table.clear_filter")} onClick={() => setTyped("")} />
            )
          }
          value={typed}
          onChange={(event) => setTyped(event.currentTarget.value)}
          data-testid="signal-filter"
        />
        <div className={classes.count} data-testid="signal-count">
          {t("desk.signal_count", { shown: found.length, total: signals.size })}
        </div>
      </div>
      <VirtualList
        label={t("desk.signals")}
        role="tree"
        testId="signals"
        rows={rows}
        rowPx={ROW_PX}
        idOf={(row) => row.id}
        onPick={pick}
        onKey={onKey}
        row={(row) => (row.kind === "signal" ? leaf(row, t) : branch(row))}
      />
      <p className={classes.foot}>{t("desk.signals_how")}</p>
    </>
  );
}

function Watched({ slug }: { slug: string }) {
  useWatchDevice(slug);
  return null;
}

function matching(signals: ReadonlyMap<string, DeskSignal>, wanted: string): DeskSignal[] {
  const words = wanted.toLowerCase().split(/\s+/).filter(Boolean);
  return [...signals.values()].filter((one) => words.every((word) => one.haystack.includes(word)));
}

/** While something is looked for all that match is open. */
function rowsOf(
  signals: readonly DeskSignal[],
  all: boolean,
  opened: ReadonlySet<string>,
  shown: ReadonlySet<string>,
): Row[] {
  const rows: Row[] = [];
  let [device, group] = ["", ""];
  for (const signal of signals) {
    const { deviceTitle, groupTitle, line } = signal;
    if (line.device !== device) {
      device = line.device;
      group = "";
      const count = signals.filter((one) => one.line.device === device).length;
      rows.push({
        kind: "device",
        id: device,
        title: deviceTitle,
        count,
        open: all || opened.has(device),
        depth: 0,
      });
    }
    if (!all && !opened.has(device)) continue;
    const id = `${device} ${signal.entry.group}`;
    if (id !== group) {
      group = id;
      const count = signals.filter(
        (one) => one.line.device === device && one.entry.group === signal.entry.group,
      ).length;
      rows.push({ kind: "group", id, title: groupTitle, count, open: all || opened.has(id), depth: 1 });
    }
    if (all || opened.has(id))
      rows.push({ kind: "signal", id: signal.name, signal, shown: shown.has(signal.name) });
  }
  return rows;
}

function branch(row: Exclude<Row, { kind: "signal" }>) {
  const Arrow = row.open ? IconChevronDown : IconChevronRight;
  return {
    props: {
      className: classes.branch ?? "",
      "aria-expanded": row.open,
      "aria-level": row.depth + 1,
      "data-depth": row.depth,
      "data-testid": `branch-${row.id}`,
    },
    cells: (
      <>
        <Arrow size={15} aria-hidden />
        <span>{row.title}</span>
        <span className="dim">{row.count}</span>
      </>
    ),
  };
}

function leaf({ signal, shown }: Extract<Row, { kind: "signal" }>, t: ReturnType<typeof useTexts>) {
  const { line, title, unit } = signal;
  return {
    props: {
      className: classes.leaf ?? "",
      "aria-selected": shown,
      "aria-level": 3,
      draggable: true,
      onDragStart: (event: React.DragEvent) => startDrag(event, signal.name),
      title: t("desk.signal_title", {
        address: line.address,
        title,
        count: figure(line.count, 0, t.language),
        changes: figure(line.changes, 0, t.language),
      }),
      "data-testid": `signal-${signal.name}`,
    },
    cells: (
      <>
        <span aria-hidden className={classes.check}>
          {shown ? "✓" : ""}
        </span>
        <span className="dim">{line.address}</span>
        <span>{title}</span>
        <span className={`${classes.right} dim`}>{line.changes === 0 ? "" : line.changes}</span>
        <span className={classes.right}>
          <AtCursor signal={signal} /> <span className="dim">{unit}</span>
        </span>
      </>
    ),
  };
}
