import { IconAlertTriangle, IconCircleCheck, IconEqualNot } from "@tabler/icons-react";
import type { FleetDoc } from "../../../api/fleet";
import { useTexts } from "../../../texts/texts";
import { dateAndTime } from "../../../ui/format";
import { useFleetDevice } from "./deviceLabel";
import classes from "./Fleet.module.css";

/** What it comes to, and what the fleet is held against. */
export function FleetSentence({ doc }: { doc: FleetDoc }) {
  const t = useTexts();
  const nameOf = useFleetDevice();
  const { golden, total, different: odd, incomplete, parameters, foreign } = doc;
  const equal = odd === 0 && incomplete === 0;
  const Icon = odd > 0 ? IconEqualNot : equal ? IconCircleCheck : IconAlertTriangle;
  const when = golden.t_ns === null ? "–" : dateAndTime(golden.t_ns / 1e6);
  return (
    <div className={classes.sentence} role="status" data-testid="fleet-sentence">
      <Icon size={24} className={equal ? "tone-ok" : "tone-warning"} aria-hidden />
      <strong>
        {total === 0
          ? t("page.fleet.no_devices")
          : t(odd === 1 ? "page.fleet.sentence_one" : "page.fleet.sentence", { odd, total, parameters })}
      </strong>
      {incomplete > 0 && (
        <span className="tone-warning" data-testid="fleet-incomplete">
          {t(incomplete === 1 ? "page.fleet.incomplete_one" : "page.fleet.incomplete", { count: incomplete })}
        </span>
      )}
      <span className="dim">{t("page.fleet.against", { device: nameOf(golden.device), when })}</span>
      {foreign.length > 0 && (
        <span className="tone-warning" title={foreign.map((one) => one.device).join("\n")}>
          {t("page.fleet.foreign", { count: foreign.length })}
        </span>
      )}
    </div>
  );
}
