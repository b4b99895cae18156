import { Button } from "@mantine/core";
import type { SignalRun } from "../../../api/signals";
import { useRole } from "../../../frame/role";
import { useCell } from "../../../live/live";
import { lockOf } from "../../../model/locks";
import { type DeviceContext, lineOf, shownOf } from "../../../model/shown";
import { useTexts } from "../../../texts/texts";
import { entriesOf } from "../../../ui/reading";
import { stage, useChange } from "../../parameters/staging";
import classes from "../signal/Signal.module.css";

type Value = NonNullable<SignalRun["proposal"]>["values"][number];

/** What the measured step suggests, why, and the way into the pending changes. */
export function ControllerProposal({ run, pmc }: { run: SignalRun; pmc: DeviceContext }) {
  const t = useTexts();
  const { proposal } = run;
  if (!proposal) return <p className="dim">{t("page.setup.controller.no_proposal")}</p>;
  return (
    <div data-testid="proposal">
      <ul className={classes.reasons}>
        {proposal.reasons.map(({ key, details }) => (
          <li key={key}>{t(`page.setup.controller.reason.${key}`, details)}</li>
        ))}
      </ul>
      {proposal.values.map((value) => (
        <Proposed key={value.address} value={value} pmc={pmc} />
      ))}
    </div>
  );
}

/** One object, old to new. What it was proposed for must still be in force. */
function Proposed({ value, pmc }: { value: Value; pmc: DeviceContext }) {
  const t = useTexts();
  const { role } = useRole();
  const pending = useChange(pmc.slug, value.address);
  const cell = useCell(pmc.slug, value.address);
  const entry = entriesOf(pmc.doc).get(value.address);
  if (!entry) return null;
  const lock = lockOf(entry, role);
  const outdated = cell?.known === true && cell.raw !== value.old;
  const shown = (raw: number) => lineOf(shownOf(entry, raw, pmc));
  return (
    <div className={classes.proposed} data-testid={`proposed-${value.address}`}>
      <span>
        {value.address} {t.nameOf(entry.title)}
      </span>
      <strong>{`${shown(value.old)} → ${shown(value.new)}`}</strong>
      <Button
        variant="default"
        h={40}
        disabled={lock !== null || outdated || pending?.raw === value.new}
        onClick={() => stage(entry, value.new, [pmc])}
        data-testid="stage-proposal"
      >
        {t("page.setup.controller.stage")}
      </Button>
      {lock !== null && <span className="tone-warning">{t(`page.locked.${lock}`)}</span>}
      {outdated && (
        <span className="tone-warning">
          {t("page.setup.controller.outdated", { address: value.address })}
        </span>
      )}
      {pending?.raw === value.new && <span className="dim">{t("page.setup.controller.staged")}</span>}
    </div>
  );
}
