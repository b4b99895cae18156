import { Checkbox, CloseButton } from "@mantine/core";
import { IconAlertTriangle } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { setQuery } from "../../../api/files";
import { descriptionQuery, turbineQuery } from "../../../api/queries";
import type { DescriptionDoc, EntryDoc, Raw, SetDoc, SetRef } from "../../../api/types";
import { usePageSearch } from "../../../frame/search";
import { useDeviceVersion, useWatchDevice } from "../../../live/live";
import { titleOf } from "../../../model/rows";
import { lineOf, shownOf } from "../../../model/shown";
import { type Translate, useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { placesOf } from "../../../ui/devices";
import { entriesOf, rawAt } from "../../../ui/reading";
import { Pairs } from "../../recordings/RecordingDetails";
import classes from "./Sets.module.css";
import { SetStateText } from "./LibraryTab";
import { setRows, type SetRow } from "./rows";

/** One set: whose it is, its values in words, and beside them what the device holds now, where it is connected. */
export function SetDetails({ file }: { file: SetRef }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const doc = useQuery(setQuery(file.reason === null ? file.name : undefined));
  return (
    <section className={room.details} aria-label={file.name} data-testid="set-details">
      <div className={room.detailsHead}>
        <h2>{file.name}</h2>
        <SetStateText file={file} />
        <span className={room.spacer} />
        <CloseButton aria-label={t("page.close")} onClick={() => update({ file: undefined })} />
      </div>
      {file.reason !== null && (
        <p className={room.note}>{t("page.sets.unusable", { reason: file.reason })}</p>
      )}
      <div className={room.detailsBody}>
        {doc.isError && <ProblemAlert error={doc.error} title={t("page.sets.unreadable")} />}
        {doc.isLoading && <span className="dim">{t("page.loading")}</span>}
        {doc.data && <Content doc={doc.data} />}
      </div>
    </section>
  );
}

function Content({ doc }: { doc: SetDoc }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const device = doc.head.origin.device;
  const turbine = useQuery(turbineQuery).data ?? undefined;
  const here = placesOf(turbine).some((place) => place.device.slug === device);
  useWatchDevice(here ? device : null);
  const version = useDeviceVersion(device);
  const description = useQuery({
    ...descriptionQuery(doc.head.description_id),
    enabled: turbine !== undefined,
  }).data;
  const rows = useMemo(
    () => setRows(doc.values, (address) => (here ? rawAt(device, address) : null)),
    // eslint-disable-next-line react-hooks/exhaustive-deps -- the version stands for what the store holds
    [doc, device, here, version],
  );
  const different = rows.filter((row) => row.different);
  const shown = search.compare === "different" ? different : rows;
  return (
    <>
      <div className={room.detailsHead} style={{ padding: "8px 0", border: 0 }}>
        {here ? (
          <>
            <Checkbox
              label={t("page.sets.only_different")}
              checked={search.compare === "different"}
              onChange={(event) => update({ compare: event.currentTarget.checked ? "different" : undefined })}
              data-testid="only-different"
            />
            <span className="dim" data-testid="different-count">
              {t("page.sets.different", { count: different.length, total: rows.length })}
            </span>
          </>
        ) : (
          <span className="dim">{t("page.sets.not_here", { device })}</span>
        )}
      </div>
      <details className={classes.facts} data-testid="set-facts">
        <summary>{t("page.sets.facts")}</summary>
        <div className={room.columns}>
          <Head doc={doc} />
          <Identity doc={doc} />
          <Unread doc={doc} />
        </div>
      </details>
      <ValueTable
        rows={shown}
        description={description}
        device={device}
        node={doc.head.origin.node}
        here={here}
      />
    </>
  );
}

interface ValueTableProps {
  rows: readonly SetRow[];
  description: DescriptionDoc | undefined;
  device: string;
  node: number;
  here: boolean;
}

function ValueTable({ rows, description, device, node, here }: ValueTableProps) {
  const t = useTexts();
  const inSet = new Map(rows.map((row) => [row.address, row.raw]));
  const words = (raw: Raw | null, address: string, lookup: (address: string) => Raw | null) =>
    raw === null ? "–" : valueWords(description, device, node, t, address, raw, lookup);
  return (
    <table className={classes.values}>
      <thead>
        <tr>
          <th>{t("page.table.column.address")}</th>
          <th>{t("page.table.column.name")}</th>
          <th>{t("page.sets.in_set")}</th>
          {here && <th>{t("page.sets.now")}</th>}
        </tr>
      </thead>
      <tbody>
        {rows.map((row) => {
          const entry = description && entriesOf(description).get(row.address);
          return (
            <tr key={row.address} data-testid={`set-${row.address}`}>
              <td>{row.address}</td>
              <td>{entry ? titleOf(entry, t) : "–"}</td>
              <td title={t("page.entry.raw_only", { raw: row.raw })}>
                {words(row.raw, row.address, (address) => inSet.get(address) ?? null)}
              </td>
              {here && (
                <td className={row.different ? classes.different : ""}>
                  {row.different && <IconAlertTriangle size={14} aria-label={t("page.sets.differs")} />}{" "}
                  {words(row.now, row.address, (address) => rawAt(device, address))}
                </td>
              )}
            </tr>
          );
        })}
        {rows.length === 0 && (
          <tr>
            <td colSpan={here ? 4 : 3} className="dim">
              {t("page.sets.all_same")}
            </td>
          </tr>
        )}
      </tbody>
    </table>
  );
}

function valueWords(
  doc: DescriptionDoc | undefined,
  slug: string,
  node: number,
  t: Translate,
  address: string,
  raw: Raw,
  lookup: (address: string) => Raw | null,
): string {
  const entry: EntryDoc | undefined = doc && entriesOf(doc).get(address);
  return doc && entry ? lineOf(shownOf(entry, raw, { slug, node, doc, lookup, t })) : String(raw);
}

function Head({ doc }: { doc: SetDoc }) {
  const t = useTexts();
  const { origin, description_id, description_version, hash } = doc.head;
  return (
    <div>
      <h3>{t("page.sets.origin")}</h3>
      <Pairs
        pairs={[
          [t("page.sets.column.device"), `${origin.device} (${origin.node})`],
          [t("page.sets.column.made"), origin.time],
          [t("page.sets.column.person"), origin.person || "–"],
          [t("page.sets.column.reason"), origin.reason || "–"],
          [t("page.sets.column.description"), `${description_id} ${description_version}`],
          [t("page.sets.tool"), origin.tool],
          ["SHA-256", hash],
          [t("page.sets.where"), doc.path],
        ]}
      />
    </div>
  );
}

function Identity({ doc }: { doc: SetDoc }) {
  const t = useTexts();
  return (
    <div>
      <h3>{t("page.sets.identity")}</h3>
      <Pairs
        pairs={Object.entries(doc.head.identity).map(([name, text]) => [
          t(`page.sets.identity_of.${name}`),
          text === null ? "–" : String(text),
        ])}
      />
    </div>
  );
}

function Unread({ doc }: { doc: SetDoc }) {
  const t = useTexts();
  const unread = Object.entries(doc.unread);
  return (
    <div>
      <h3>{t("page.sets.unread")}</h3>
      {unread.length === 0 ? (
        <p style={{ margin: 0, fontSize: 13 }}>{t("page.sets.unread_none", { empty: doc.empty.length })}</p>
      ) : (
        <Pairs pairs={unread} />
      )}
    </div>
  );
}
