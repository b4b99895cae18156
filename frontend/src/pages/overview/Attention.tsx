import {
  IconAlertOctagon,
  IconAlertTriangle,
  IconArrowRight,
  IconCircleCheck,
  IconInfoCircle,
} from "@tabler/icons-react";
import { useQueries, useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { useState } from "react";
import { useDescriptionQuery, useTurbineQuery } from "../../api/queries";
import type { Details, Turbine } from "../../api/types";
import { type PageSearch, roomSearch } from "../../frame/search";
import { useAxes, useHearing, useLink, useNodes, useServerNow, useStore } from "../../live/live";
import { asVariant, variantOf } from "../../model/variant";
import { type Translate, useTexts } from "../../texts/texts";
import { placesOf } from "../../ui/devices";
import { rawAt } from "../../ui/reading";
import { type Finding, findingsOf } from "./attention";
import { deviceFindings, type Watched } from "./deviceFindings";
import classes from "./Overview.module.css";

const REFRESH_MS = 1000;
/** More than these are behind a button: the blades are to be seen as well. */
const SHOWN = 5;

export function Attention() {
  const t = useTexts();
  const [all, setAll] = useState(false);
  const turbine = useQuery(useTurbineQuery()).data;
  const nowMs = useServerNow(REFRESH_MS);
  const hearing = useHearing().state === "hearing";
  const link = useLink();
  const watched = useWatched(turbine, t);
  const more = link?.state === "connected" ? deviceFindings(watched) : [];
  const findings = findingsOf({ turbine, link, nodes: useNodes(), axes: useAxes(), nowMs, more });
  // A page that hears nothing, or does not know the values yet, may not say that all is well.
  const known = watched.length > 0 && watched.length === placesOf(turbine).length;
  const allWell = hearing && known && findings.length === 0;
  const shown = hearing ? findings.slice(0, all ? undefined : SHOWN) : [];
  const left = findings.length - SHOWN;
  return (
    <section
      className={`${classes.attention} bench`}
      aria-label={t("page.attention.title")}
      data-testid="attention"
    >
      <h2>{t("page.attention.title")}</h2>
      {allWell && (
        <p className="tone-ok">
          <IconCircleCheck size={18} aria-hidden /> {t("page.attention.none")}
        </p>
      )}
      {hearing && !known && findings.length === 0 && <p className="dim">{t("page.attention.not_known")}</p>}
      <ul>
        {shown.map((finding) => (
          <FindingLine key={finding.id} finding={finding} />
        ))}
        {hearing && left > 0 && (
          <li>
            <button type="button" className={classes.more} aria-expanded={all} onClick={() => setAll(!all)}>
              {all ? t("page.attention.fewer") : t("page.more", { count: left })}
            </button>
          </li>
        )}
      </ul>
    </section>
  );
}

/** The turbine's devices with what the socket told of them. */
function useWatched(turbine: Turbine | undefined, t: Translate): Watched[] {
  const store = useStore();
  const describe = useDescriptionQuery();
  const places = placesOf(turbine);
  const ids = [...new Set(places.map(({ device }) => device.description_id))];
  const docs = useQueries({ queries: ids.map((id) => describe(id)) });
  return places.flatMap(({ station, device: { slug, node, description_id } }): Watched[] => {
    const doc = docs[ids.indexOf(description_id)]?.data;
    const cells = store.cells(slug);
    if (!doc || !cells) return [];
    const lookup = (address: string) => rawAt(store, slug, address);
    const own = asVariant(doc, variantOf(doc, lookup));
    return [{ station, context: { slug, node, doc: own, t, lookup }, cells }];
  });
}

/** With the station's name as people say it. */
function placed(details: Details, t: Translate): Details {
  const { blade, station } = details;
  return { ...details, station: typeof blade === "number" ? t("page.blade", { blade }) : (station ?? null) };
}

const ICONS = { error: IconAlertOctagon, warning: IconAlertTriangle, info: IconInfoCircle };

function FindingLine({ finding }: { finding: Finding }) {
  const t = useTexts();
  const Icon = ICONS[finding.tone];
  const { device, search: more } = finding;
  return (
    <li>
      <Icon size={18} className={finding.tone === "info" ? "dim" : `tone-${finding.tone}`} aria-hidden />
      <span className="visually-hidden">{t(`page.severity.${finding.tone}`)}</span>
      <span>{t(finding.key, placed(finding.details, t))}</span>
      {device !== null && (
        <Link to="/parameters" search={(before: PageSearch) => roomSearch(before, { device, ...more })}>
          {t("page.rooms.parameters")} <IconArrowRight size={15} aria-hidden />
        </Link>
      )}
    </li>
  );
}
