import { IconAlertTriangle } from "@tabler/icons-react";
import { useMemo } from "react";
import type { DescriptionDoc, Raw, SetDoc } from "../../../api/types";
import { titleOf } from "../../../model/rows";
import { categoriesOf, categoryName } from "../../../model/saving";
import { lineOf, shownOf } from "../../../model/shown";
import { useTexts } from "../../../texts/texts";
import { dayAndTime } from "../../../ui/format";
import { entriesOf } from "../../../ui/reading";
import classes from "./Library.module.css";

interface Props {
  doc: SetDoc;
  description: DescriptionDoc | undefined;
}

/** The values of a set in words; where they come from a recording, when and how each was seen. */
export function ValueTable({ doc, description }: Props) {
  const t = useTexts();
  const { device, node } = doc.record.origin;
  const rows = useMemo(() => Object.entries(doc.values).toSorted(([a], [b]) => a.localeCompare(b)), [doc]);
  const parts = description !== undefined && categoriesOf(description).length > 0;
  const words = (address: string, raw: Raw) => {
    const entry = description && entriesOf(description).get(address);
    const lookup = (other: string) => doc.values[other] ?? null;
    if (!description || !entry) return String(raw);
    return lineOf(shownOf(entry, raw, { slug: device, node, doc: description, lookup, t }));
  };
  return (
    <table className={classes.values}>
      <thead>
        <tr>
          <th>{t("page.table.column.address")}</th>
          <th>{t("page.table.column.name")}</th>
          <th>{t("page.sets.in_set")}</th>
          {parts && <th>{t("page.saving.category")}</th>}
          {doc.seen && <th>{t("page.sets.seen", { recording: doc.recording ?? "" })}</th>}
        </tr>
      </thead>
      <tbody>
        {rows.map(([address, raw]) => {
          const entry = description && entriesOf(description).get(address);
          return (
            <tr key={address} data-testid={`set-${address}`}>
              <td>{address}</td>
              <td>{entry ? titleOf(entry, t) : "–"}</td>
              <td title={t("page.entry.raw_only", { raw })}>{words(address, raw)}</td>
              {parts && <td>{entry?.save_category == null ? "–" : categoryName(entry.save_category, t)}</td>}
              {doc.seen && (
                <td>
                  <SeenText seen={doc.seen[address]} />
                </td>
              )}
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}

type Seen = NonNullable<SetDoc["seen"]>[string];

/** "read 14:03:22 by another master"; with a warning where the device may hold another value since. */
function SeenText({ seen }: { seen: Seen | undefined }) {
  const t = useTexts();
  if (!seen) return "–";
  return (
    <>
      {t(`page.sets.seen_${seen.access}`, { time: dayAndTime(seen.t_ns / 1e6) })}
      {!seen.ours && <span className="dim"> {t("page.sets.seen_foreign")}</span>}
      {seen.doubt !== null && (
        <span className="tone-warning">
          {" "}
          <IconAlertTriangle size={14} aria-hidden /> {t(`page.sets.doubt.${seen.doubt.replace("-", "_")}`)}
        </span>
      )}
    </>
  );
}
