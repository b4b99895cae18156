import { IconAlertTriangle, IconHistory } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { type ChangedDevice, type SinceLastVisit as Changes, sinceLastVisitQuery } from "../../api/visits";
import type { Raw } from "../../api/types";
import { type PageSearch, roomSearch } from "../../frame/search";
import { useBench, useLink } from "../../live/live";
import { localise } from "../../model/values";
import { type Translate, useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { dayAndTime } from "../../ui/format";
import { storyOf } from "../../ui/problem";
import { parameterSearch } from "../../ui/ReadingText";
import { compareSearch, ofDevice, Source } from "../sets/compare/specs";
import classes from "./Overview.module.css";

/** The parameters as found now beside those that the last visit left. */
export function SinceLastVisit() {
  const t = useTexts();
  const bench = useBench();
  const connected = useLink()?.state === "connected";
  const query = useQuery(sinceLastVisitQuery(bench?.epoch, connected && bench?.turbine != null));
  return (
    <section className={classes.visit} aria-label={t("page.visit.since")} data-testid="since-last-visit">
      <h2>
        <IconHistory size={17} aria-hidden /> {t("page.visit.since")}
      </h2>
      {query.data ? (
        <Told changes={query.data} />
      ) : (
        <p className="dim">
          {query.error
            ? storyOf(query.error, t).happened
            : t(connected ? "page.loading" : "page.visit.not_connected")}
        </p>
      )}
    </section>
  );
}

function Told({ changes }: { changes: Changes }) {
  const t = useTexts();
  const { visit, state } = changes;
  if (state === "no-earlier-visit") return <p className="dim">{t("page.visit.first")}</p>;
  if (state === "reading") return <p className="dim">{t("page.visit.reading")}</p>;
  const devices = changes.devices.filter(
    (one) => one.rows.length > 0 || one.unknown.length > 0 || one.missing !== null || one.replaced,
  );
  const count = devices.reduce((sum, one) => sum + one.rows.length, 0);
  const when = visit === null ? "–" : dayAndTime((visit.ended_ns ?? visit.started_ns) / 1e6);
  const who = t("page.visit.last", { when, person: visit?.person ?? null });
  if (devices.length === 0)
    return (
      <p>
        {t("page.visit.nothing")} <span className="dim">{who}</span>
      </p>
    );
  return (
    <details>
      <summary>
        <strong>{t(count === 1 ? "page.visit.one" : "page.visit.many", { count })}</strong>{" "}
        <span className="dim">{who}</span>
      </summary>
      {devices.map((one) => (
        <Device key={one.device} changed={one} />
      ))}
    </details>
  );
}

function Device({ changed }: { changed: ChangedDevice }) {
  const t = useTexts();
  const slug = changed.device;
  const name = useDeviceName()(slug);
  return (
    <>
      <h3>
        {name}{" "}
        {changed.missing === null && (
          <Link
            to="/sets"
            search={(before: PageSearch) =>
              roomSearch(before, compareSearch([ofDevice(Source.Left, slug), ofDevice(Source.Found, slug)]))
            }
            data-testid={`compare-${slug}`}
          >
            {t("page.visit.compare")}
          </Link>
        )}
      </h3>
      {changed.replaced && <Warning text={t("page.visit.replaced")} />}
      {changed.missing !== null && <Warning text={t(`page.visit.missing_${changed.missing}`)} />}
      <ul>
        {changed.rows.map((row) => (
          <li key={row.address}>
            <Link
              to="/parameters"
              search={(before: PageSearch) => roomSearch(before, parameterSearch(slug, row.address))}
            >
              {row.address} {t.nameOf(row.name)}
            </Link>
            <span>
              {told(row.was_key, row.was_raw, row.was_shown, t)} →{" "}
              <strong>{told(row.now_key, row.now_raw, row.now_shown, t)}</strong>
            </span>
            <span className="dim">
              {row.t_ns === null
                ? t("page.visit.unseen")
                : t("page.visit.by", {
                    person: row.person === "" ? t("page.visit.other_master") : row.person,
                    when: dayAndTime(row.t_ns / 1e6),
                  })}
            </span>
          </li>
        ))}
      </ul>
      {changed.unknown.length > 0 && (
        <p className="dim">{t("page.visit.unknown", { count: changed.unknown.length })}</p>
      )}
    </>
  );
}

/** In words where an enumeration names the value. */
function told(key: string | null, raw: Raw, shown: string, t: Translate): string {
  if (key !== null) return t(key);
  return typeof raw === "number" ? localise(shown, t.language) : shown;
}

function Warning({ text }: { text: string }) {
  return (
    <p className="tone-warning">
      <IconAlertTriangle size={15} aria-hidden /> {text}
    </p>
  );
}
