import {
  IconAlertTriangle,
  IconArrowBackUp,
  IconArrowRight,
  IconCheck,
  IconCircleCheck,
  IconDeviceFloppy,
  IconEqual,
  IconHourglass,
  IconX,
} from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { turbineQuery } from "../../../api/queries";
import type { RestoreDoc, RestoreValue } from "../../../api/restore";
import type { Raw } from "../../../api/types";
import { titleOf } from "../../../model/rows";
import { type DeviceContext, lineOf, shownOf } from "../../../model/shown";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { placesOf, useDeviceName } from "../../../ui/devices";
import { entriesOf } from "../../../ui/reading";
import { useContexts } from "../../parameters/devicesOf";
import { idOf, withUnit } from "./plan";
import classes from "./Restore.module.css";
import { keptOf, Stage, stageOf } from "./run";

interface ValueLine {
  id: string;
  value: RestoreValue;
  device: string;
  title: string;
  before: string;
  wanted: string;
  stage: Stage;
}

const SIGNS = {
  [Stage.Equal]: { Icon: IconEqual, tone: "dim" },
  [Stage.Waiting]: { Icon: IconHourglass, tone: "dim" },
  [Stage.Untouched]: { Icon: IconEqual, tone: "dim" },
  [Stage.Sent]: { Icon: IconArrowRight, tone: "" },
  [Stage.ReadBack]: { Icon: IconCheck, tone: "" },
  [Stage.Saved]: { Icon: IconDeviceFloppy, tone: "" },
  [Stage.Proven]: { Icon: IconCircleCheck, tone: "tone-ok" },
  [Stage.Back]: { Icon: IconArrowBackUp, tone: "tone-warning" },
  [Stage.Failed]: { Icon: IconX, tone: "tone-error" },
  [Stage.Unknown]: { Icon: IconAlertTriangle, tone: "tone-warning" },
} as const;

/** Every value that the restore answers for, with how far it is. */
export function RunValues({ doc }: { doc: RestoreDoc }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const contexts = useContexts(placesOf(useQuery(turbineQuery).data ?? undefined));
  const columns = useMemo(() => columnsOf(t), [t]);
  const lines = useMemo(() => {
    const kept = keptOf(doc);
    return doc.values
      .filter((value) => value.state !== "equal")
      .map((value): ValueLine => {
        const { title, shown } = wordsOf(value, contexts.get(value.device), t);
        return {
          id: idOf(value),
          value,
          device: nameOf(value.device),
          title,
          before: shown(value.before_raw, value.before_shown),
          wanted: shown(value.wanted_raw, value.wanted_shown),
          stage: stageOf(value, kept),
        };
      });
  }, [doc, contexts, nameOf, t]);
  const equal = doc.values.length - lines.length;
  return (
    <DataTable
      label={t("page.restoring.values")}
      name="run"
      rows={lines}
      columns={columns}
      idOf={(line) => line.id}
      fileName="hubside-restore"
      empty={t("page.restoring.no_values")}
      tools={<span className="dim">{t("page.restoring.equal_already", { count: equal })}</span>}
      live={doc.end === null}
    />
  );
}

function wordsOf(value: RestoreValue, context: DeviceContext | undefined, t: Translate) {
  const entry = context && entriesOf(context.doc).get(value.address);
  const shown = (raw: Raw, plain: string) =>
    entry ? lineOf(shownOf(entry, raw, context)) : withUnit(plain, value.unit);
  return { title: entry ? titleOf(entry, t) : value.name, shown };
}

function columnsOf(t: Translate): TableColumn<ValueLine>[] {
  const title = (id: string) => t(`page.restoring.column.${id}`);
  return [
    {
      id: "stage",
      title: title("stage"),
      width: "minmax(130px, 0.8fr)",
      fixed: true,
      text: (line) => t(`page.restoring.stage.${line.stage}`),
      cell: (line) => <StageText stage={line.stage} />,
    },
    { id: "device", title: title("device"), width: "110px", text: (line) => line.device },
    { id: "address", title: title("address"), width: "84px", text: (line) => line.value.address },
    {
      id: "name",
      title: title("name"),
      width: "minmax(180px, 1.6fr)",
      fixed: true,
      text: (line) => line.title,
    },
    {
      id: "before",
      title: title("before"),
      width: "minmax(90px, 0.8fr)",
      fixed: true,
      text: (line) => line.before,
    },
    {
      id: "wanted",
      title: title("wanted"),
      width: "minmax(90px, 0.8fr)",
      fixed: true,
      text: (line) => line.wanted,
    },
  ];
}

function StageText({ stage }: { stage: Stage }) {
  const t = useTexts();
  const { Icon, tone } = SIGNS[stage];
  return (
    <span className={`${classes.cell} ${tone}`} data-stage={stage}>
      <Icon size={16} aria-hidden />
      <span>{t(`page.restoring.stage.${stage}`)}</span>
    </span>
  );
}
