import { Link } from "@tanstack/react-router";
import { memo, type SyntheticEvent } from "react";
import { useStore } from "../live/live";
import { type PageSearch, roomSearch } from "../frame/search";
import type { DeviceContext } from "../model/shown";
import { hexadecimal, isInteger } from "../model/values";
import { type Translate, useTexts } from "../texts/texts";
import classes from "./ReadingText.module.css";
import { age } from "./format";
import { type Pace, type Reading, readingIn, useReading } from "./reading";

const DASH = "–";

interface Props {
  context: DeviceContext | null;
  address: string;
  pace: Pace;
  /** Words for values that are no measurement, such as a broken wire. */
  instead?: (raw: number) => string | null;
  tone?: "warning" | "error" | undefined;
}

/** A value with its unit; raw value and age on hover, grey with its age where stale; it leads to its parameter. */
export const ReadingText = memo(function ReadingText({ context, address, pace, instead, tone }: Props) {
  const t = useTexts();
  const store = useStore();
  const reading = useReading(context, address, pace);
  if (!context || !reading) return <span className="dim">{DASH}</span>;
  // How old it is says the title: that is put right when somebody comes to read it, not all the time.
  const look = ({ currentTarget }: SyntheticEvent<HTMLElement>) => {
    const now = readingIn(store, context, address, pace, false);
    if (now) currentTarget.title = titleOf(now, t);
  };
  const words = typeof reading.raw === "number" ? (instead?.(reading.raw) ?? null) : null;
  return (
    <Link
      to="/parameters"
      search={(before: PageSearch) => roomSearch(before, parameterSearch(context.slug, address))}
      className={`${classes.reading} ${tone === undefined ? "" : `tone-${tone}`}`}
      data-stale={reading.stale}
      data-testid={`reading-${address}`}
      title={titleOf(reading, t)}
      onPointerEnter={look}
      onFocus={look}
    >
      {words ?? plainText(reading)}
      {reading.stale && <em>{age(reading.ageMs, t.language)}</em>}
    </Link>
  );
});

/** Where the parameter of an object is shown. */
export function parameterSearch(device: string, address: string): PageSearch {
  return { device, q: address };
}

function plainText({ text, unit, names }: Reading): string {
  if (names.length > 0) return names.join(", ");
  return unit === "" ? text : `${text} ${unit}`;
}

function titleOf({ entry, raw, ageMs }: Reading, t: Translate): string {
  const hex = typeof raw === "number" && isInteger(entry) ? ` · ${hexadecimal(entry, raw)}` : "";
  return t("page.reading.title", {
    name: t.nameOf(entry.title),
    address: entry.address,
    raw: `${raw}${hex}`,
    age: age(ageMs, t.language),
  });
}
