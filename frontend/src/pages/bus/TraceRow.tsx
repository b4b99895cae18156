import { IconAlertOctagon, IconAlertTriangle, IconArrowLeft, IconArrowRight } from "@tabler/icons-react";
import { memo } from "react";
import type { TraceItem, TraceLine } from "../../api/trace";
import { type Translate, useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { timeOfDay } from "../../ui/format";
import classes from "./Bus.module.css";
import { idText, noteTexts, objectName, serviceText, shownBytes, valueText } from "./lines";

/** A row has no room for more objects: all of them stand in the detail. */
const SHOWN_ITEMS = 12;
/** So many have room for their names. */
const NAMED_ITEMS = 3;

interface Props {
  line: TraceLine;
  top: number;
  index: number;
  picked: boolean;
  query: string;
  onPick: (tNs: number) => void;
}

/** One frame, 21 px high: when, which way, whose, what it carried and what that means. */
export const TraceRow = memo(function TraceRow({ line, top, index, picked, query, onPick }: Props) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const gap = line.service === "gap";
  const Arrow = line.direction === "tx" ? IconArrowRight : IconArrowLeft;
  return (
    <div
      role="row"
      aria-rowindex={index + 2}
      aria-selected={picked}
      className={classes.traceRow}
      data-tone={line.tone}
      data-service={line.service}
      data-picked={picked}
      data-testid="trace-row"
      data-t={String(line.t_ns)}
      style={{ transform: `translateY(${String(top)}px)` }}
      onClick={() => onPick(line.t_ns)}
    >
      <span role="gridcell">{timeOfDay(line.t_ns / 1e6)}</span>
      <span role="gridcell" data-direction={line.direction}>
        {!gap && <Arrow size={12} aria-hidden />}
        {gap ? "" : line.direction}
      </span>
      <span role="gridcell">{gap ? "" : idText(line)}</span>
      <span role="gridcell" className={classes.clip}>
        {line.node > 0 && <b>{line.node}</b>} {line.device === null ? "" : nameOf(line.device)}
      </span>
      <span role="gridcell" className={classes.clip}>
        {serviceText(line, t)}
      </span>
      <b role="gridcell" className={`${classes.bytes} ${classes.clip}`}>
        {line.remote ? "RTR" : shownBytes(line).join(" ")}
      </b>
      <span role="gridcell" className={classes.meaning}>
        <Meaning line={line} query={query} t={t} />
      </span>
    </div>
  );
});

/** One frame with many objects: then the names of all have no room. */
const isCarrying = (line: TraceLine): boolean => line.service === "modbus-response" || line.fdl !== null;

function Meaning({ line, query, t }: { line: TraceLine; query: string; t: Translate }) {
  const Sign = line.tone === "error" ? IconAlertOctagon : line.tone === "warning" ? IconAlertTriangle : null;
  // Of a telegram the remark says what it is about: behind all its objects there is no room for it.
  const notes = noteTexts(line, t).map((note) => (
    <em key={note} data-first={line.fdl !== null}>
      <Marked text={note} query={query} />
    </em>
  ));
  return (
    <>
      {Sign && <Sign size={13} aria-hidden />}
      {line.step !== null && <i>{t(`trace.step.${line.step}`)}</i>}
      {line.fdl !== null && notes}
      {line.items.slice(0, SHOWN_ITEMS).map((item, at) => (
        <Item
          key={`${item.address}-${String(at)}`}
          item={item}
          named={isCarrying(line) ? line.items.length <= NAMED_ITEMS : true}
          query={query}
          t={t}
        />
      ))}
      {line.items.length > SHOWN_ITEMS && (
        <em>{t("trace.page.more_objects", { count: line.items.length - SHOWN_ITEMS })}</em>
      )}
      {line.fdl === null && notes}
    </>
  );
}

interface ItemProps {
  item: TraceItem;
  named: boolean;
  query: string;
  t: Translate;
}

function Item({ item, named, query, t }: ItemProps) {
  return (
    <span className={classes.item} data-named={named} title={named ? undefined : objectName(item, t)}>
      <code>
        <Marked text={item.address} query={query} />
      </code>
      {named && (
        <span className={classes.clip}>
          <Marked text={objectName(item, t)} query={query} />
        </span>
      )}
      {item.text !== null && <b>{valueText(item, t)}</b>}
    </span>
  );
}

/** The text with every place marked that the search found. */
export function Marked({ text, query }: { text: string; query: string }) {
  const wanted = query.trim().toLowerCase();
  const at = wanted === "" ? -1 : text.toLowerCase().indexOf(wanted);
  if (at < 0) return text;
  const end = at + wanted.length;
  return (
    <>
      {text.slice(0, at)}
      <mark>{text.slice(at, end)}</mark>
      <Marked text={text.slice(end)} query={query} />
    </>
  );
}
