import { Button, Select } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { useState } from "react";
import { compareQuery, type RowDoc } from "../../../api/compare";
import { digitsOf } from "../../../api/trace";
import { type PageSearch, roomSearch, usePageSearch } from "../../../frame/search";
import { useStanding, useStore } from "../../../live/live";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { timeOfDay } from "../../../ui/format";
import { compareSearch, momentOf, ofDevice, Source } from "../../sets/compare/specs";
import classes from "./Desk.module.css";
import own from "./Parameters.module.css";

const KINDS = { latest: Source.Latest, golden: Source.Golden, delivered: Source.Delivered } as const;
const MOMENT = "moment";
const NOTHING = "nothing";
type Kind = keyof typeof KINDS | typeof MOMENT;

export interface AgainstWhat {
  /** null: the parameters are compared with nothing. */
  kind: Kind | null;
  /** The other moment of the recording. */
  tNs: number | null;
}

const isKind = (text: string): text is keyof typeof KINDS => text in KINDS;

/** What the parameters at the cursor are compared with, as it stands in the URL. */
export function useAgainst(): AgainstWhat {
  const [{ against = "" }] = usePageSearch();
  if (isKind(against)) return { kind: against, tNs: null };
  const tNs = /^\d{10,19}$/.test(against) ? Number(against) : null;
  return { kind: tNs === null ? null : MOMENT, tNs };
}

/** Chooses what to compare with; another moment is where the cursor stands now. */
export function Against({ against }: { against: AgainstWhat }) {
  const t = useTexts();
  const store = useStore();
  const [, update] = usePageSearch();
  const here = () => update({ against: digitsOf(store.cursor?.t_ns ?? 0) });
  const moment =
    against.tNs === null
      ? t("desk.against.moment")
      : t("desk.against.moment_at", { time: timeOfDay(against.tNs / 1e6) });
  return (
    <div className={own.against}>
      <Select
        aria-label={t("desk.against.label")}
        value={against.kind ?? NOTHING}
        allowDeselect={false}
        data={[
          { value: NOTHING, label: t("desk.against.nothing") },
          ...Object.keys(KINDS).map((one) => ({ value: one, label: t(`desk.against.${one}`) })),
          { value: MOMENT, label: moment },
        ]}
        onChange={(chosen) => {
          if (chosen === MOMENT) here();
          else update({ against: chosen === null || chosen === NOTHING ? undefined : chosen });
        }}
        data-testid="against"
      />
      <Button variant="default" px="sm" onClick={here} title={t("desk.set_b_why")} data-testid="set-b">
        {t("desk.set_b")}
      </Button>
    </div>
  );
}

interface Props {
  replay: string;
  device: string;
  against: AgainstWhat;
}

/** What differs between the moment at the cursor and something else; while it plays, as of where it began. */
export function Differences({ replay, device, against }: Props) {
  const t = useTexts();
  const standing = useStanding();
  const [seen, setSeen] = useState(standing);
  if (standing !== null && standing !== seen) setSeen(standing);
  const columns = seen === null ? [] : columnsOf(replay, device, seen, against);
  const compared = useQuery(compareQuery(columns, {}, false));
  const rows = (compared.data?.rows ?? []).filter(
    (row) => row.state === "different" || row.state === "missing",
  );
  const different = rows.filter((row) => row.state === "different");
  const here = seen === null ? "–" : timeOfDay(seen / 1e6);
  const there =
    against.tNs === null ? t(`desk.against.${against.kind ?? NOTHING}`) : timeOfDay(against.tNs / 1e6);
  return (
    <>
      <div className={own.summary}>
        <span role="status" data-testid="difference-count">
          {compared.data
            ? t("desk.different", { count: different.length, of: compared.data.rows.length })
            : t("page.loading")}
        </span>
        <Link
          to="/sets"
          search={(before: PageSearch) => roomSearch(before, compareSearch(columns))}
          className={own.link}
          data-testid="open-compare"
        >
          {t("desk.open_compare")}
        </Link>
      </div>
      {compared.isError && <ProblemAlert error={compared.error} title={t("desk.compare_failed")} />}
      <div className={classes.scroll} tabIndex={0} role="region" aria-label={t("desk.differences")}>
        <table className={own.table} data-testid="differences">
          <thead>
            <tr>
              <th>{t("desk.parameter")}</th>
              <th>{here}</th>
              <th>{there}</th>
            </tr>
          </thead>
          <tbody>
            {different.map((row) => (
              <tr key={row.address} data-testid={`different-${row.address}`}>
                <td title={`${row.name} (${row.address})`}>
                  {t.nameOf(row.name)} <span className="dim">{row.address}</span>
                </td>
                <Cell row={row} at={0} />
                <Cell row={row} at={1} />
              </tr>
            ))}
          </tbody>
        </table>
        {compared.data && different.length === 0 && (
          <p className={classes.empty}>{t("desk.no_difference")}</p>
        )}
        {rows.length > different.length && (
          <p className={classes.empty}>{t("desk.missing", { count: rows.length - different.length })}</p>
        )}
      </div>
    </>
  );
}

function Cell({ row, at }: { row: RowDoc; at: number }) {
  const t = useTexts();
  const cell = row.cells[at];
  if (cell?.state !== "value") return <td className="dim">–</td>;
  const text = cell.text_key === null ? cell.shown : t(cell.text_key);
  return (
    <td title={String(cell.raw)}>
      {text.replace("-", "−")} <span className="dim">{cell.unit}</span>
    </td>
  );
}

function columnsOf(replay: string, device: string, tNs: number, against: AgainstWhat): string[] {
  const here = momentOf(replay, tNs, device);
  if (against.tNs !== null) return [here, momentOf(replay, against.tNs, device)];
  const { kind } = against;
  return kind === null || kind === MOMENT ? [here] : [here, ofDevice(KINDS[kind], device)];
}
