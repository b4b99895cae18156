import { IconAlertOctagon, IconAlertTriangle, IconArrowRight, IconCircleCheck } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { turbineQuery } from "../../api/queries";
import { type PageSearch, readSearch } from "../../frame/search";
import { useAxes, useHearing, useLink, useNodes, useServerNow } from "../../live/live";
import { useTexts } from "../../texts/texts";
import { type Finding, findingsOf } from "./attention";
import classes from "./Overview.module.css";

const REFRESH_MS = 1000;

export function Attention() {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data;
  const nowMs = useServerNow(REFRESH_MS);
  const hearing = useHearing().state === "hearing";
  const findings = findingsOf({ turbine, link: useLink(), nodes: useNodes(), axes: useAxes(), nowMs });
  // A page that hears nothing may not say that all is well.
  const allWell = hearing && findings.length === 0;
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
      <ul>{hearing && findings.map((finding) => <FindingLine key={finding.id} finding={finding} />)}</ul>
    </section>
  );
}

function FindingLine({ finding }: { finding: Finding }) {
  const t = useTexts();
  const Icon = finding.tone === "error" ? IconAlertOctagon : IconAlertTriangle;
  const { device } = finding;
  return (
    <li>
      <Icon size={18} className={`tone-${finding.tone}`} aria-hidden />
      <span className="visually-hidden">{t(`page.severity.${finding.tone}`)}</span>
      <span>{t(finding.key, finding.details)}</span>
      {device !== null && (
        <Link to="/parameters" search={(before: PageSearch) => readSearch({ ...before, device })}>
          {t("page.rooms.parameters")} <IconArrowRight size={15} aria-hidden />
        </Link>
      )}
    </li>
  );
}
