import { Checkbox } from "@mantine/core";
import { IconAlertTriangle, IconCircleCheck } from "@tabler/icons-react";
import type { PlanDoc, PlanFinding } from "../../../api/restore";
import { useTexts } from "../../../texts/texts";
import type { Terms } from "./order";

interface Props {
  plan: PlanDoc;
  terms: Terms;
  onTerms: (terms: Terms) => void;
}

/** What the rules say: what the restore breaks, what is broken anyhow, what it mends, what could not be judged. */
export function Findings({ plan, terms, onTerms }: Props) {
  const t = useTexts();
  const broken = plan.findings.filter((one) => one.verdict === "broken");
  const unjudged = plan.findings.filter((one) => one.verdict === "not-checked");
  const parts = [
    { part: "new", found: broken.filter((one) => one.is_new) },
    { part: "standing", found: broken.filter((one) => !one.is_new) },
    { part: "mended", found: plan.mended },
  ].filter(({ found }) => found.length > 0);
  return (
    <section data-testid="restore-findings">
      <h2 className={broken.length > 0 ? "tone-warning" : ""}>
        {broken.length > 0 ? (
          <IconAlertTriangle size={20} aria-hidden />
        ) : (
          <IconCircleCheck size={20} aria-hidden />
        )}
        {t(`page.restoring.rules.${broken.length > 0 ? "broken" : "kept"}`, { count: broken.length })}
      </h2>
      {parts.map(({ part, found }) => (
        <div key={part} data-testid={`findings-${part}`}>
          <h3>{t(`page.restoring.rules.part.${part}`, { count: found.length })}</h3>
          <ul>
            {found.map((one, at) =>
              part === "mended" ? (
                <MendedLine key={`${one.rule} ${at}`} finding={one} />
              ) : (
                <FindingLine
                  key={`${one.rule} ${at}`}
                  finding={one}
                  plan={plan}
                  terms={terms}
                  onTerms={onTerms}
                />
              ),
            )}
          </ul>
        </div>
      ))}
      {unjudged.length > 0 && (
        <details>
          <summary>{t("page.restoring.rules.not_checked", { count: unjudged.length })}</summary>
          <ul>
            {unjudged.map((one) => (
              <li key={one.rule}>
                {t(`rule.${one.rule}.title`)}
                <small>{t("rule.not_checked", one.details)}</small>
              </li>
            ))}
          </ul>
        </details>
      )}
    </section>
  );
}

/** The numbers of its text are those of now. */
function MendedLine({ finding }: { finding: PlanFinding }) {
  const t = useTexts();
  return (
    <li data-testid={`mended-${finding.rule}`}>
      <span className="tone-ok">{t("page.restoring.rules.now")}</span>{" "}
      {t(`rule.${finding.rule}.broken`, finding.details)}
    </li>
  );
}

/** An expert may accept an error that stands in the station already; a new one the server lets nobody accept. */
function FindingLine({ finding, plan, terms, onTerms }: Props & { finding: PlanFinding }) {
  const t = useTexts();
  const { rule, severity } = finding;
  const accepted = terms.accepted.includes(rule);
  const blocks = plan.blockers.some((one) => one.rule === rule);
  const others = terms.accepted.filter((one) => one !== rule);
  return (
    <li data-testid={`finding-${rule}`}>
      <span className={severity === "error" ? "tone-error" : severity === "warning" ? "tone-warning" : "dim"}>
        {t(`page.restoring.severity.${severity}`)}
      </span>{" "}
      {t(`rule.${rule}.broken`, finding.details)}
      <small>{t(`rule.${rule}.why`)}</small>
      {blocks && finding.is_new && terms.expert && (
        <small className="tone-error">{t("page.restoring.rules.never_accepted")}</small>
      )}
      {terms.expert && !finding.is_new && (blocks || accepted) && (
        <Checkbox
          label={t("page.restoring.rules.accept")}
          checked={accepted}
          onChange={() => onTerms({ ...terms, accepted: accepted ? others : [...others, rule] })}
          data-testid={`accept-${rule}`}
        />
      )}
    </li>
  );
}
