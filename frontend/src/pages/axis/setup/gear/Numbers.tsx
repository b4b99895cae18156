import { Button } from "@mantine/core";
import { NeedsRole } from "../../../../frame/NeedsRole";
import { useShown } from "../../../../live/live";
import { type Fraction, toFixed, wholeOf } from "../../../../model/decimal";
import { type Facts, type Held, highestVelocity, type Scaling, speedFor } from "../../../../model/gear";
import type { DeviceContext } from "../../../../model/shown";
import { localise, show } from "../../../../model/values";
import { type Translate, useTexts } from "../../../../texts/texts";
import { plannedContext, stage, useStaged } from "../../../parameters/staging";
import axis from "../../Axis.module.css";
import classes from "./Gear.module.css";
import {
  BLADE,
  entryAt,
  heldAt,
  MOTOR,
  MOTOR_SPEED,
  numberAt,
  rowsOf,
  type Side,
  sideInUse,
  VELOCITY,
} from "./sides";

interface Props {
  pmc: DeviceContext;
  side: Side;
  scaling: Scaling;
  facts: Facts;
}

const held = ({ above, below }: Held): string => `${above} / ${below}`;

/** A fraction as a number; exact where it is whole. */
function number(exact: Fraction, decimals: number, t: Translate): string {
  const whole = wholeOf(exact);
  return whole === null ? localise(toFixed(exact, decimals), t.language) : String(whole);
}

/** The fractions with what they mean, and what each object holds before and after. */
export function Numbers({ pmc, side, scaling, facts }: Props) {
  const t = useTexts();
  const { resolution, gear, feed } = scaling;
  const told = [
    ["resolution", held(resolution)],
    ["gear", held(gear)],
    ["feed", held(feed)],
    ["per_unit", number(facts.perUnit, 5, t)],
    ["per_turn", number(facts.perTurn, 2, t)],
    ["units_per_turn", number(facts.unitsPerEncoderTurn, 5, t)],
    ["unit", `${number(facts.degreesPerUnit, 5, t)}°`],
  ] as const;
  return (
    <>
      <dl className={classes.facts} data-testid={`facts-${side.name}`}>
        {told.map(([name, text]) => (
          <div key={name}>
            <dt>{t(`page.setup.gear.fact.${name}`)}</dt>
            <dd data-testid={`${name}-${side.name}`}>{text}</dd>
          </div>
        ))}
      </dl>
      {(resolution.reduced || gear.reduced || feed.reduced) && (
        <p className="dim">{t("page.setup.gear.reduced")}</p>
      )}
      {wholeOf(facts.perTurn) === null && (
        <p className="tone-warning">{t("page.setup.gear.not_whole_turn")}</p>
      )}
      {side.name === MOTOR.name && <Velocity pmc={pmc} gear={gear} ownFeed={feed} />}
      <Rows pmc={pmc} rows={rowsOf(side, scaling)} />
    </>
  );
}

function Rows({ pmc, rows }: { pmc: DeviceContext; rows: readonly [string, number][] }) {
  const t = useTexts();
  return (
    <div className={classes.scroll}>
      <table className={axis.history}>
        <thead>
          <tr>
            {["object", "name", "drive", "new"].map((name) => (
              <th key={name} scope="col">
                {t(`page.setup.gear.column.${name}`)}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {rows.map(([address, raw]) => {
            const now = numberAt(pmc, address);
            const entry = entryAt(pmc, address);
            return (
              <tr key={address} data-testid={`row-${address}`}>
                <td>{address}</td>
                <td>{entry ? t.nameOf(entry.title) : "–"}</td>
                <td>{now ?? "–"}</td>
                <td className={now === raw ? "dim" : "tone-warning"}>
                  {now === raw ? "=" : "→"} {raw}
                </td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

/** Whether 607Fh and 6080h go with this gear; the greatest 607Fh can be staged at once. */
function Velocity({ pmc, gear, ownFeed }: { pmc: DeviceContext; gear: Held; ownFeed: Held }) {
  const t = useTexts();
  const { recorded } = useShown();
  useStaged();
  const planned = recorded ? pmc : plannedContext(pmc);
  const speed = numberAt(planned, MOTOR_SPEED);
  const velocity = numberAt(planned, VELOCITY);
  // The units of 607Fh are those of the encoder in use; of the motor's own, what is typed here counts.
  const feed = sideInUse(planned) === BLADE ? heldAt(planned, BLADE.feed) : ownFeed;
  const entry = entryAt(pmc, VELOCITY);
  if (speed === null || velocity === null || feed === null || !entry) return null;
  const highest = highestVelocity(speed, gear, feed);
  const fits = BigInt(velocity) <= highest;
  const shown = (raw: bigint | number) => show(entry, Number(raw), pmc.lookup, t.language);
  return (
    <div className={classes.row} data-testid="velocity" data-fits={fits}>
      <span className={fits ? undefined : "tone-warning"}>
        {t(fits ? "page.setup.gear.velocity_fits" : "page.setup.gear.velocity_beyond", {
          highest: shown(highest),
          highest_raw: String(highest),
          velocity: shown(velocity),
          needed: String(speedFor(velocity, gear, feed)),
          speed,
        })}
      </span>
      {!fits && !recorded && highest > 0n && (
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              variant="default"
              disabled={locked}
              onClick={() => stage(entry, Number(highest), [pmc])}
              data-testid="stage-velocity"
            >
              {t("page.setup.gear.stage_velocity", { highest: shown(highest) })}
            </Button>
          )}
        </NeedsRole>
      )}
    </div>
  );
}
