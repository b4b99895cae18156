import {
  IconAlertTriangle,
  IconArrowRight,
  IconCircleX,
  IconHelpCircle,
  IconInfoCircle,
} from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import type { RuleFinding, RuleSeverity } from "../../api/rules";
import { turbineQuery } from "../../api/queries";
import { titleOf } from "../../model/rows";
import { findingKey, isBroken, lineOfFinding, reasonOfFinding } from "../../model/ruleFindings";
import { useTexts } from "../../texts/texts";
import { placesOf, useDeviceName } from "../../ui/devices";
import { useContexts } from "./devicesOf";
import classes from "./Rules.module.css";
import { entriesOf } from "./staging";

const ICONS: Record<RuleSeverity, typeof IconInfoCircle> = {
  error: IconCircleX,
  warning: IconAlertTriangle,
  note: IconInfoCircle,
};

interface Props {
  findings: readonly RuleFinding[];
  /** The object beside which they stand: it needs no link. */
  here?: { device: string; address: string } | undefined;
  onJump: (device: string, address: string) => void;
}

/** Each finding with its rule, why that is one, and the way to the objects it is about; what was not checked is folded. */
export function RuleFindingList({ findings, here, onJump }: Props) {
  const t = useTexts();
  const broken = findings.filter(isBroken);
  const unjudged = findings.filter((one) => !isBroken(one));
  if (findings.length === 0) return null;
  return (
    <div className={classes.list} data-testid="rule-findings">
      {broken.length > 0 && (
        <ul>
          {broken.map((one) => (
            <Broken key={findingKey(one)} finding={one} here={here} onJump={onJump} />
          ))}
        </ul>
      )}
      {unjudged.length > 0 && (
        <details data-testid="rules-unjudged">
          <summary>
            <IconHelpCircle size={16} aria-hidden /> {t("page.rules.unjudged", { count: unjudged.length })}
          </summary>
          <ul>
            {unjudged.map((one) => (
              <li key={findingKey(one)}>
                <span>
                  <b>{t(`rule.${one.rule}.title`)}</b> {lineOfFinding(one, t)}
                </span>
              </li>
            ))}
          </ul>
        </details>
      )}
    </div>
  );
}

function Broken({ finding, here, onJump }: Omit<Props, "findings"> & { finding: RuleFinding }) {
  const t = useTexts();
  const Icon = ICONS[finding.severity];
  const others = finding.places.filter(
    (place) => place.device !== here?.device || place.address !== here.address,
  );
  return (
    <li data-severity={finding.severity} data-testid={`rule-${finding.rule}`}>
      <Icon size={17} role="img" aria-label={t(`rule.severity.${finding.severity}`)} />
      <div>
        <b>{lineOfFinding(finding, t)}</b>
        <small>{reasonOfFinding(finding, t)}</small>
        <Jumps places={others} onJump={onJump} />
      </div>
    </li>
  );
}

function Jumps({ places, onJump }: { places: RuleFinding["places"]; onJump: Props["onJump"] }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const turbine = useQuery(turbineQuery).data;
  const contexts = useContexts(useMemo(() => placesOf(turbine), [turbine]));
  return (
    <div className={classes.jumps}>
      {places.map(({ device, address }) => {
        const doc = contexts.get(device)?.doc;
        const entry = doc && entriesOf(doc).get(address);
        return (
          <button
            key={`${device} ${address}`}
            type="button"
            onClick={() => onJump(device, address)}
            data-testid={`rule-jump-${address}`}
          >
            {nameOf(device)} <span>{address}</span> {entry ? titleOf(entry, t) : ""}
            <IconArrowRight size={15} aria-hidden />
          </button>
        );
      })}
    </div>
  );
}
