import { Link } from "@tanstack/react-router";
import type { Telegram, TelegramWord } from "../../api/lines";
import { type PageSearch, roomSearch } from "../../frame/search";
import { type DeviceContext, lineOf, shownOf } from "../../model/shown";
import { useTexts } from "../../texts/texts";
import { parameterSearch } from "../../ui/ReadingText";
import { entriesOf } from "../../ui/reading";
import classes from "./Line.module.css";

interface Props {
  telegram: Telegram;
  /** What it sent last is no longer of now. */
  stale: boolean;
  context: DeviceContext | null;
}

/** The process data of a telegram both ways, word by word: bytes as they stand on the wire, and what they tell. */
export function TelegramTables({ telegram, stale, context }: Props) {
  return (
    <div className={classes.ways}>
      <Words name="received" words={telegram.received} stale={false} context={context} />
      <Words name="sent" words={telegram.sent} stale={stale} context={context} />
    </div>
  );
}

interface WordsProps {
  name: "received" | "sent";
  words: TelegramWord[];
  stale: boolean;
  context: DeviceContext | null;
}

function Words({ name, words, stale, context }: WordsProps) {
  const t = useTexts();
  return (
    <table className={classes.words} data-stale={stale} data-testid={`words-${name}`}>
      <caption>{t(`lines.way.${name}`)}</caption>
      <thead>
        <tr>
          <th scope="col">{t("lines.column.word")}</th>
          <th scope="col">{t("lines.column.signal")}</th>
          <th scope="col">{t("lines.column.bytes")}</th>
          <th scope="col">{t("lines.column.value")}</th>
        </tr>
      </thead>
      <tbody>
        {words.flatMap((word) =>
          word.signals.map((signal, at) => (
            <tr key={signal.name} data-testid={`signal-${signal.name}`}>
              {at === 0 && <td rowSpan={word.signals.length}>{placeOf(word)}</td>}
              <td>
                <SignalName signal={signal} context={context} />
              </td>
              {at === 0 && (
                <td rowSpan={word.signals.length}>
                  <code>{word.data === "" ? "–" : word.data}</code>
                </td>
              )}
              <td>
                <Value signal={signal} context={context} />
              </td>
            </tr>
          )),
        )}
      </tbody>
    </table>
  );
}

type Signal = TelegramWord["signals"][number];

function SignalName({ signal, context }: { signal: Signal; context: DeviceContext | null }) {
  const t = useTexts();
  const entry = signal.address === null ? undefined : context && entriesOf(context.doc).get(signal.address);
  if (!entry || !context)
    return (
      <>
        {t(`lines.signal.${signal.name}`)} <small className="dim">{signal.name}</small>
      </>
    );
  return (
    <Link
      to="/parameters"
      search={(before: PageSearch) => roomSearch(before, parameterSearch(context.slug, entry.address))}
    >
      {t.nameOf(entry.title)}
    </Link>
  );
}

/** Value with its unit and the raw number; a dash while nobody knows the order of bytes. */
function Value({ signal, context }: { signal: Signal; context: DeviceContext | null }) {
  const t = useTexts();
  if (signal.raw === null) return <span className="dim">–</span>;
  const entry = signal.address === null ? undefined : context && entriesOf(context.doc).get(signal.address);
  if (!entry || !context) return <>{signal.raw}</>;
  const text = lineOf(shownOf(entry, signal.raw, context));
  return <span title={t("lines.raw", { raw: signal.raw })}>{text}</span>;
}

const placeOf = (word: TelegramWord): string =>
  word.words === 1 ? String(word.word) : `${String(word.word)}–${String(word.word + word.words - 1)}`;
