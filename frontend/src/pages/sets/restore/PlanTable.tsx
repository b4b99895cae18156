import { Button, Checkbox, SegmentedControl } from "@mantine/core";
import {
  IconAlertTriangle,
  IconArrowRight,
  IconBan,
  IconEqual,
  IconRefresh,
  IconSquare,
} from "@tabler/icons-react";
import { useMemo } from "react";
import { usePageSearch } from "../../../frame/search";
import { categoryName } from "../../../model/saving";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { GroupMenu } from "./GroupMenu";
import { inView, isLeftOut, isPickable, isPicked, type PlanLine, View, VIEWS } from "./plan";
import classes from "./Restore.module.css";

interface Props {
  lines: readonly PlanLine[];
  /** Puts lines into the restore, or takes them out. */
  onPick: (changed: readonly PlanLine[], on: boolean) => void;
  /** The devices are being read. */
  reading: boolean;
  onReadAgain: () => void;
}

const HIDDEN_FIRST = ["group", "address"];

export const viewIn = (text: string | undefined): View =>
  VIEWS.find((one) => one === text) ?? View.Differences;

/** Every object of the sets with what becomes of it; those that can be written are picked here. */
export function PlanTable({ lines, onPick, reading, onReadAgain }: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const view = viewIn(search.rows);
  const shown = useMemo(() => lines.filter((line) => inView(line, view)), [lines, view]);
  const parts = lines.some((line) => line.row.save_category !== null);
  const columns = useMemo(() => columnsOf(t, onPick, parts), [t, onPick, parts]);
  const toggle = (line: PlanLine) => {
    if (isPickable(line)) onPick([line], !isPicked(line));
  };
  return (
    <div className={classes.main}>
      <div className={classes.views}>
        <SegmentedControl
          aria-label={t("page.restoring.view.label")}
          data={VIEWS.map((one) => ({
            value: one,
            label: t(`page.restoring.view.${one}`, {
              count: lines.filter((line) => inView(line, one)).length,
            }),
          }))}
          value={view}
          onChange={(next) => update({ rows: next === View.Differences ? undefined : next })}
          data-testid="plan-view"
        />
        <Button
          variant="default"
          loading={reading}
          leftSection={<IconRefresh size={17} aria-hidden />}
          onClick={onReadAgain}
          data-testid="plan-again"
        >
          {t("page.restoring.read_again")}
        </Button>
      </div>
      <DataTable
        label={t("page.restoring.plan")}
        name="plan"
        rows={shown}
        columns={columns}
        idOf={(line) => line.id}
        fileName="hubside-restore-plan"
        empty={t(`page.restoring.none.${view}`)}
        onOpen={toggle}
        hiddenFirst={HIDDEN_FIRST}
        tools={<GroupMenu lines={lines} onPick={onPick} />}
      />
    </div>
  );
}

/** `parts`: a device saves by categories, so that each object has one. */
function columnsOf(t: Translate, onPick: Props["onPick"], parts: boolean): TableColumn<PlanLine>[] {
  const title = (id: string) => t(`page.restoring.column.${id}`);
  const category: TableColumn<PlanLine> = {
    id: "category",
    title: t("page.saving.category"),
    width: "minmax(96px, 0.5fr)",
    text: ({ row }) => (row.save_category === null ? "–" : categoryName(row.save_category, t)),
  };
  return [
    {
      id: "pick",
      title: "",
      width: "34px",
      fixed: true,
      text: (line) => (isPicked(line) ? "x" : ""),
      cell: (line) => <Pick line={line} onPick={onPick} />,
    },
    {
      id: "outcome",
      title: title("outcome"),
      width: "minmax(196px, 1fr)",
      fixed: true,
      text: (line) => line.outcome,
      cell: (line) => <Outcome line={line} />,
    },
    { id: "device", title: title("device"), width: "52px", text: (line) => line.kind },
    { id: "group", title: title("group"), width: "minmax(90px, 0.6fr)", text: (line) => line.groupTitle },
    { id: "address", title: title("address"), width: "72px", text: (line) => line.row.address },
    {
      id: "name",
      title: title("name"),
      width: "minmax(150px, 1.5fr)",
      fixed: true,
      text: (line) => `${line.row.address} ${line.title}`,
      by: (line) => line.title,
      cell: (line) => (
        <span className={classes.words}>
          <span>{line.title}</span>
          <small>
            {line.row.address} · {line.groupTitle}
          </small>
        </span>
      ),
    },
    {
      id: "now",
      title: title("now"),
      width: "minmax(80px, 0.7fr)",
      fixed: true,
      text: (line) => line.now,
      cell: (line) => <span className={classes.now}>{line.now}</span>,
    },
    {
      id: "wanted",
      title: title("wanted"),
      width: "minmax(90px, 0.7fr)",
      fixed: true,
      text: (line) => line.wanted,
      cell: (line) => (
        <span className={classes.wanted} data-written={isPicked(line)}>
          {line.wanted}
        </span>
      ),
    },
    ...(parts ? [category] : []),
  ];
}

function Pick({ line, onPick }: { line: PlanLine; onPick: Props["onPick"] }) {
  const t = useTexts();
  if (!isPickable(line)) return null;
  return (
    <span className={classes.pick} onClick={(event) => event.stopPropagation()}>
      <Checkbox
        tabIndex={-1}
        checked={isPicked(line)}
        aria-label={t("page.restoring.pick", { name: line.title, address: line.row.address })}
        onChange={(event) => onPick([line], event.currentTarget.checked)}
        data-testid={`pick-${line.id}`}
      />
    </span>
  );
}

const SIGNS = { write: IconArrowRight, equal: IconEqual, skip: IconBan } as const;

/** What becomes of it; rules that it breaks in the end stand beside it. */
function Outcome({ line }: { line: PlanLine }) {
  const t = useTexts();
  const { row, rules, unordered, outcome } = line;
  const Sign = isLeftOut(row.why) ? IconSquare : SIGNS[row.treatment];
  const tone = unordered ? "tone-error" : row.treatment === "write" ? "" : "dim";
  const broken = rules.map((rule) => t(`rule.${rule}.title`)).join("\n");
  return (
    <span className={`${classes.cell} ${tone}`} data-treatment={row.treatment} title={outcome}>
      {unordered ? <IconAlertTriangle size={16} aria-hidden /> : <Sign size={16} aria-hidden />}
      <span>{outcome}</span>
      {broken !== "" && (
        <span className="tone-warning" title={broken}>
          <IconAlertTriangle size={16} aria-hidden />
          <span className="visually-hidden">{broken}</span>
        </span>
      )}
    </span>
  );
}
