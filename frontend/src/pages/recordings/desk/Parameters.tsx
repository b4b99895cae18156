import { Button, Popover, Select, TextInput } from "@mantine/core";
import { IconDeviceFloppy, IconFilter, IconHistory } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useDeferredValue, useMemo, useState } from "react";
import { type ChangeLine, ramHistoryQuery } from "../../../api/replay";
import { usePageSearch } from "../../../frame/search";
import { useStore, useWatchDevice } from "../../../live/live";
import { lineOf, shownOf } from "../../../model/shown";
import { useReplay } from "../../../replay/opening";
import { useTexts } from "../../../texts/texts";
import { timeOfDay } from "../../../ui/format";
import { Against, Differences, useAgainst } from "./Differences";
import classes from "./Desk.module.css";
import own from "./Parameters.module.css";
import { AtCursor } from "./Legend";
import { SaveMoment } from "./SaveMoment";
import type { DeskSignal } from "./signals";
import { VirtualList } from "./VirtualList";

const ROW_PX = 34;

/** What is set, not measured: it can be written, and does not travel in PDOs by itself. */
export const isParameter = ({ entry }: DeskSignal): boolean => entry.writable && (entry.saved || !entry.pdo);

interface Props {
  replay: string;
  signals: ReadonlyMap<string, DeskSignal>;
}

/** The parameters of a device as of the cursor: what was in force, what was changed, how that differs from others. */
export function Parameters({ replay, signals }: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const all = useMemo(() => [...signals.values()].filter(isParameter), [signals]);
  const devices = useMemo(() => [...new Map(all.map((one) => [one.line.device, one.deviceTitle]))], [all]);
  const device = devices.find(([slug]) => slug === search.device)?.[0] ?? devices[0]?.[0] ?? "";
  const against = useAgainst();
  const [saving, setSaving] = useState(false);
  useWatchDevice(device === "" ? null : device);
  if (device === "") return <p className={classes.empty}>{t("desk.no_parameters")}</p>;
  return (
    <>
      <div className={own.head}>
        <Select
          aria-label={t("desk.device")}
          value={device}
          data={devices.map(([value, label]) => ({ value, label }))}
          allowDeselect={false}
          onChange={(slug) => update({ device: slug ?? undefined })}
          data-testid="parameter-device"
        />
        <Button
          variant="default"
          px="sm"
          leftSection={<IconDeviceFloppy size={17} aria-hidden />}
          onClick={() => setSaving(true)}
          data-testid="save-moment"
        >
          {t("desk.keep")}
        </Button>
        <Against against={against} />
      </div>
      {against.kind === null ? (
        <AsOfCursor replay={replay} rows={all.filter((one) => one.line.device === device)} />
      ) : (
        <Differences replay={replay} device={device} against={against} />
      )}
      {saving && (
        <SaveMoment replay={replay} device={device} devices={devices} onClose={() => setSaving(false)} />
      )}
    </>
  );
}

function AsOfCursor({ replay, rows }: { replay: string; rows: readonly DeskSignal[] }) {
  const t = useTexts();
  const [typed, setTyped] = useState("");
  const [changed, setChanged] = useState(false);
  const wanted = useDeferredValue(typed).trim().toLowerCase();
  const shown = rows.filter((one) => (!changed || one.line.changes > 1) && one.haystack.includes(wanted));
  const [open, setOpen] = useState<string | null>(null);
  return (
    <>
      <div className={classes.filter}>
        <TextInput
          aria-label={t("desk.find_parameter")}
          placeholder={t("desk.find_parameter")}
          leftSection={<IconFilter size={17} aria-hidden />}
          value={typed}
          onChange={(event) => setTyped(event.currentTarget.value)}
          data-testid="parameter-filter"
        />
        <div className={classes.filterLine}>
          <Button
            variant="default"
            size="compact-sm"
            h={32}
            aria-pressed={changed}
            onClick={() => setChanged(!changed)}
            data-testid="only-changed"
          >
            {t(changed ? "desk.changed_all" : "desk.changed_only")}
          </Button>
          <span className="dim">{t("page.table.count", { shown: shown.length, total: rows.length })}</span>
        </div>
      </div>
      <VirtualList
        label={t("desk.tab.parameters")}
        testId="moment-parameters"
        rows={shown}
        rowPx={ROW_PX}
        idOf={(one) => one.name}
        onPick={(one) => setOpen(open === one.name ? null : one.name)}
        row={(one) => ({
          props: {
            className: own.row ?? "",
            title: `${one.title} (${one.line.address})`,
            "data-testid": `moment-${one.line.address}`,
          },
          cells: (
            <>
              <span className="dim">{one.line.address}</span>
              <span>{one.title}</span>
              <History replay={replay} signal={one} open={open === one.name} onClose={() => setOpen(null)} />
              <span className={classes.right}>
                <AtCursor signal={one} /> <span className="dim">{one.unit}</span>
              </span>
            </>
          ),
        })}
      />
    </>
  );
}

interface HistoryProps {
  replay: string;
  signal: DeskSignal;
  open: boolean;
  onClose: () => void;
}

/** The mark that a value was changed in this recording; opened, when and by what. */
function History({ replay, signal, open, onClose }: HistoryProps) {
  const t = useTexts();
  const { changes } = signal.line;
  const mark = changes > 1 && (
    <span className={`${own.changed} tone-warning`}>
      <IconHistory size={14} aria-hidden />
      {t("desk.changed", { count: changes - 1 })}
    </span>
  );
  if (!open) return <span className={own.mark}>{mark}</span>;
  return (
    <Popover
      opened
      withRoles={false}
      onChange={(opened) => !opened && onClose()}
      position="right"
      withArrow
      shadow="md"
    >
      <Popover.Target>
        <span className={own.mark}>{mark}</span>
      </Popover.Target>
      <Popover.Dropdown onClick={(event) => event.stopPropagation()}>
        <Changes replay={replay} signal={signal} />
      </Popover.Dropdown>
    </Popover>
  );
}

const SOURCES: Readonly<Record<string, string>> = {
  "sdo-read": "desk.source.read",
  "sdo-write": "desk.source.written",
  pdo: "desk.source.pdo",
  emcy: "desk.source.emcy",
};

function Changes({ replay, signal }: { replay: string; signal: DeskSignal }) {
  const t = useTexts();
  const store = useStore();
  const transport = useReplay()?.transport;
  const { device, address } = signal.line;
  const changes = useQuery(ramHistoryQuery(replay, device, address)).data;
  const nowNs = store.cursor?.t_ns ?? 0;
  const text = ({ raw }: ChangeLine) =>
    raw === null ? t("desk.unknown_from") : lineOf(shownOf(signal.entry, raw, signal.context));
  return (
    <div className={own.history} data-testid="history">
      <h3>{t("desk.history", { title: signal.title, address })}</h3>
      {changes?.map((change) => (
        <button
          key={change.t_ns}
          type="button"
          data-past={change.t_ns <= nowNs}
          onClick={() => transport?.seek(change.t_ns)}
        >
          <span>{timeOfDay(change.t_ns / 1e6)}</span>
          <strong>{text(change)}</strong>
          <span className="dim">{change.source === null ? "" : t(SOURCES[change.source] ?? "")}</span>
        </button>
      ))}
    </div>
  );
}
