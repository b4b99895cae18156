import { Button } from "@mantine/core";
import type { EntryDoc, Raw } from "../../api/types";
import { useCell, useServerNow } from "../../live/live";
import { lineOf, shownOf } from "../../model/shown";
import { defaultOf } from "../../model/values";
import { age } from "../../ui/format";
import { ageMsOf, isStale, isUnsaved, rawOf } from "./cellValue";
import { useDevice } from "./context";
import classes from "./Parameters.module.css";
import { plannedContext, useChange } from "./staging";
import { useSilent } from "./silent";
import { reasonOf } from "./ValueCell";

const AGE_MS = 1000;

interface PlaceLine {
  name: string;
  raw: Raw | null;
  text: string;
  note: string;
  stale?: boolean;
}

/** The places of a value, told apart: what is pending here, RAM, non-volatile memory, and what the maker delivers. */
export function Places({ entry, onTake }: { entry: EntryDoc; onTake: ((raw: Raw) => void) | null }) {
  const { t } = useDevice();
  return (
    <dl className={classes.places}>
      {usePlaceLines(entry).map(({ name, raw, text, note, stale }) => (
        <div key={name} data-testid={`entry-${name}`} data-stale={stale === true}>
          <dt>{t(`page.entry.${name}`)}</dt>
          <dd>
            <b>{text}</b>
            <span className="dim">{note}</span>
          </dd>
          {onTake && raw !== null && name !== "pending" && (
            <dd>
              <Button
                size="compact-sm"
                variant="subtle"
                className={classes.take}
                aria-label={t("page.entry.take_from", { place: t(`page.entry.${name}`) })}
                onClick={() => onTake(raw)}
                data-testid={`take-${name}`}
              >
                {t("page.entry.take")}
              </Button>
            </dd>
          )}
        </div>
      ))}
    </dl>
  );
}

function usePlaceLines(entry: EntryDoc): PlaceLine[] {
  const device = useDevice();
  const { t, slug } = device;
  const cell = useCell(slug, entry.address);
  const change = useChange(slug, entry.address);
  const nowMs = useServerNow(AGE_MS);
  const silent = useSilent(slug);
  const line = (raw: Raw | null) => (raw === null ? "–" : lineOf(shownOf(entry, raw, device)));
  const ram = rawOf(cell);
  const standard = defaultOf(entry, device.node);
  const lines: PlaceLine[] = [
    {
      name: "ram",
      raw: ram,
      text: line(ram),
      note: ramNote(),
      stale: cell ? isStale(entry, cell, nowMs, silent) : false,
    },
    storedLine(),
    { name: "default", raw: standard, text: line(standard), note: "" },
  ];
  if (!change) return lines;
  const pending: PlaceLine = {
    name: "pending",
    raw: change.raw,
    text: `${lineOf(shownOf(entry, change.raw, plannedContext(device)))} ${change.refused ? "✕" : "✎"}`,
    note: change.refused ? reasonOf(change.refused, t) : t("page.entry.not_written"),
  };
  return [pending, ...lines];

  function ramNote(): string {
    if (!cell || ram === null) {
      if (!entry.readable) return t("page.table.write_only_title");
      return t(cell ? "page.table.unknown_since_restart" : "page.table.never_read");
    }
    const source = cell.source === null ? "–" : t(`page.source.${cell.source.replaceAll("-", "_")}`);
    const details = { raw: ram, hex: cell.hex, source, age: age(ageMsOf(cell, nowMs), t.language) };
    return t("page.entry.ram_note", details);
  }

  function storedLine(): PlaceLine {
    if (!entry.saved)
      return {
        name: "stored",
        raw: null,
        text: t("page.table.not_kept"),
        note: t("page.table.not_kept_title"),
      };
    if (!cell?.stored) return { name: "stored", raw: null, text: "–", note: t("page.table.stored_unknown") };
    const { raw, state } = cell.stored;
    const differs = isUnsaved(entry, cell) ? ` · ${t("page.table.unsaved_title")}` : "";
    const mark = state === "proven" ? "•" : "◦";
    return {
      name: "stored",
      raw,
      text: `${line(raw)} ${mark}`,
      note: `${t(`page.stored.${state}`)}${differs}`,
    };
  }
}
