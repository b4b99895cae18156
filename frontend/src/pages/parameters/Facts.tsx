import { useQueries } from "@tanstack/react-query";
import { IconAlertTriangle, IconQuestionMark } from "@tabler/icons-react";
import type { EntryDoc } from "../../api/types";
import { unmet } from "../../model/findings";
import { type ParameterRow, titleOf } from "../../model/rows";
import { categoryName } from "../../model/saving";
import { limitText, lineOf, shownOf } from "../../model/shown";
import { isHex, quantityOf, restsOn, show } from "../../model/values";
import { useBenchOfTable, useDevice } from "./context";
import { detailsOf, historyQuery } from "./history";
import classes from "./Parameters.module.css";
import { entriesOf } from "./staging";

interface Props {
  row: ParameterRow;
  onOpen: (address: string) => void;
}

/** What the description knows of an object, what it depends on and who depends on it, and its history. */
export function Facts({ row, onOpen }: Props) {
  const device = useDevice();
  const { t, doc } = device;
  const { entry } = row;
  const unit = isHex(entry) ? "" : quantityOf(entry, device.lookup).unit;
  const facts: [string, string][] = [
    ["limits", `${limitText(entry, device, true) || "–"} ${unit}`.trim()],
    ["type", entry.type],
    ["access", t(`page.access.${entry.access.replace("(w)", "_factory")}`)],
    ["restore", t(`page.restore.${entry.restore}`)],
    ["verify", t(`page.verify.${entry.verify}`)],
    ["section", entry.section || "–"],
  ];
  if (doc.save.some((command) => command.category !== null) && entry.saved)
    facts.splice(3, 0, [
      "category",
      entry.save_category === null ? t("page.entry.any_category") : categoryName(entry.save_category, t),
    ]);
  const needs = entry.requires.map(({ address, values, writing = [] }) => {
    const need = `${address} = ${values.map(String).join(", ")}`;
    return writing.length > 0 ? `${writing.map(String).join(", ")}: ${need}` : need;
  });
  if (needs.length > 0) facts.push(["requires", needs.join("; ")]);
  if (entry.step > 1)
    facts.splice(1, 0, ["step", `${show(entry, entry.step, device.lookup, t.language)} ${unit}`.trim()]);
  return (
    <div className={classes.facts}>
      {entry.note !== null && <p>{t(entry.note)}</p>}
      {entry.inferred && <Inferred entry={entry} />}
      <Unmet entry={entry} />
      <dl>
        {facts.map(([name, text]) => (
          <div key={name} data-testid={`entry-${name}`}>
            <dt className="dim">{t(`page.entry.${name}`)}</dt>
            <dd>{text}</dd>
          </div>
        ))}
      </dl>
      <Links title={t("page.entry.rests_on")} addresses={restsOn(entry)} onOpen={onOpen} />
      <Links title={t("page.entry.used_by")} addresses={usedBy(entry, doc.entries)} onOpen={onOpen} />
      <History entry={entry} />
    </div>
  );
}

/** Why the object cannot be written at present: what it needs, and what there is. */
function Unmet({ entry }: { entry: EntryDoc }) {
  const device = useDevice();
  const { t, doc, lookup } = device;
  const inWords = (address: string, raw: number) => {
    const other = entriesOf(doc).get(address);
    return other ? lineOf(shownOf(other, raw, device)) : String(raw);
  };
  return unmet(entry, null, lookup).map(({ address, values }) => {
    const other = entriesOf(doc).get(address);
    const details = {
      name: `${address} ${other ? titleOf(other, t) : ""}`.trim(),
      found: inWords(address, Number(lookup(address))),
      values: values.map((raw) => inWords(address, raw)).join(", "),
    };
    return (
      <p key={address} className={`${classes.inferred} tone-warning`} data-testid={`unmet-${address}`}>
        <IconAlertTriangle size={15} aria-hidden />
        <span>{t("lines.unmet", details)}</span>
      </p>
    );
  });
}

/** What the device's own manual does not print of the object, and what tells it instead. */
function Inferred({ entry: { unproven, origin } }: { entry: EntryDoc }) {
  const { t, doc } = useDevice();
  const facts =
    unproven.length === 0
      ? t("page.entry.inferred_all")
      : unproven.map((fact) => t(`page.entry.fact.${fact}`)).join(", ");
  const source = origin === null ? t("page.entry.no_origin") : (doc.sources[origin] ?? origin);
  return (
    <p className={classes.inferred} data-testid="inferred">
      <IconQuestionMark size={15} aria-hidden />
      <span>{t("page.entry.inferred", { facts, source })}</span>
    </p>
  );
}

/** Objects whose unit, limits or preconditions rest on this one. */
function usedBy(entry: EntryDoc, entries: readonly EntryDoc[]): string[] {
  return entries.filter((one) => restsOn(one).includes(entry.address)).map((one) => one.address);
}

function Links({
  title,
  addresses,
  onOpen,
}: {
  title: string;
  addresses: string[];
  onOpen: Props["onOpen"];
}) {
  const { t, doc } = useDevice();
  if (addresses.length === 0) return null;
  return (
    <section>
      <h3>{title}</h3>
      <ul>
        {addresses.map((address) => {
          const entry = entriesOf(doc).get(address);
          return (
            <li key={address}>
              <button type="button" className={classes.link} onClick={() => onOpen(address)}>
                {address} {entry ? titleOf(entry, t) : ""}
              </button>
            </li>
          );
        })}
      </ul>
    </section>
  );
}

const MOST_CHANGES = 20;

function History({ entry }: { entry: EntryDoc }) {
  const { t } = useDevice();
  const { devices, recorded, nameOf } = useBenchOfTable();
  const found = useQueries({
    queries: recorded ? [] : devices.map(({ slug }) => historyQuery(slug, entry.address)),
  });
  const changes = devices
    .flatMap(({ slug }, at) => (found[at]?.data ?? []).map((change) => ({ slug, change })))
    .sort((a, b) => b.change.t_ns - a.change.t_ns)
    .slice(0, MOST_CHANGES);
  if (recorded) return null;
  return (
    <section data-testid="history">
      <h3>{t("page.history.title")}</h3>
      {changes.length === 0 && <p className="dim">{t("page.history.none")}</p>}
      <ul>
        {changes.map(({ slug, change }) => (
          <li key={`${slug} ${change.t_ns}`}>
            {t(devices.length > 1 ? "page.history.line_of" : "page.history.line", {
              ...detailsOf(change, t),
              device: nameOf(slug),
            })}
          </li>
        ))}
      </ul>
    </section>
  );
}
