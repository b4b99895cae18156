import { useTexts } from "../../texts/texts";
import { ReadingText } from "../../ui/ReadingText";
import type { DeviceContext } from "../../model/shown";
import { entriesOf, type Pace } from "../../ui/reading";
import { BladeFacts, type Contexts, Fact } from "../overview/BladeFacts";
import { EfcChain } from "../overview/EfcChain";
import overview from "../overview/Overview.module.css";
import classes from "./Axis.module.css";

/** Objects of the axis controller: name, address and how often it is read. */
const MOTION: readonly { key: string; address: string; pace: Pace }[] = [
  { key: "mode", address: "6061", pace: "slow" },
  { key: "position", address: "6064", pace: "fast" },
  { key: "demand", address: "6062", pace: "slow" },
  { key: "target", address: "607A", pace: "slow" },
  { key: "following_error", address: "60F4", pace: "slow" },
  { key: "blade_encoder", address: "6864", pace: "rare" },
  { key: "velocity", address: "606C", pace: "fast" },
  { key: "target_velocity", address: "60FF", pace: "kept" },
  { key: "current", address: "6078", pace: "slow" },
  { key: "torque", address: "6077", pace: "slow" },
  { key: "dc_link", address: "6079", pace: "slow" },
  { key: "mode", address: "0/40", pace: "slow" },
  { key: "position", address: "12/100", pace: "fast" },
  { key: "target", address: "12/21", pace: "rare" },
  { key: "following_error", address: "12/103", pace: "slow" },
];
const CURRENT = "6078";
const TORQUE = "6077";
/** Supply and temperatures of a drive that has no power module beside it. */
const OWN_POWER: typeof MOTION = [
  { key: "supply", address: "4014:01", pace: "slow" },
  { key: "logic_supply", address: "4014:02", pace: "slow" },
  { key: "board", address: "4014:03", pace: "slow" },
  { key: "motor", address: "4014:04", pace: "slow" },
];

/** What the description has; all of it as long as that is not there. */
function shownOf(facts: typeof MOTION, context: DeviceContext | null): typeof MOTION {
  if (context === null) return facts;
  const entries = entriesOf(context.doc);
  // The torque stands in for the current on a drive that gives none.
  return facts.filter(({ address }) => entries.has(address) && !(address === TORQUE && entries.has(CURRENT)));
}

export function Measurements({ pmm, pmc }: Contexts) {
  const t = useTexts();
  const drive = pmc !== null && OWN_POWER.some(({ address }) => entriesOf(pmc.doc).has(address));
  return (
    <>
      <section className={classes.panel} aria-label={t("page.axis.motion")}>
        <h2>{t("page.axis.motion")}</h2>
        <dl className={overview.facts}>
          {shownOf(MOTION, pmc).map(({ key, address, pace }) => (
            <Fact key={key} name={t(`page.axis.quantity.${key}`)}>
              <ReadingText context={pmc} address={address} pace={pace} />
            </Fact>
          ))}
        </dl>
      </section>
      {drive ? (
        <section className={classes.panel} aria-label={t("page.axis.drive")}>
          <h2>{t("page.axis.drive")}</h2>
          <dl className={overview.facts}>
            {shownOf(OWN_POWER, pmc).map(({ key, address, pace }) => (
              <Fact key={key} name={t(`page.axis.quantity.${key}`)}>
                <ReadingText context={pmc} address={address} pace={pace} />
              </Fact>
            ))}
          </dl>
        </section>
      ) : (
        <section className={classes.panel} aria-label={t("page.axis.power")}>
          <h2>{t("page.axis.power")}</h2>
          <dl className={overview.facts}>
            <BladeFacts pmm={pmm} pmc={pmc} />
            <Fact name={t("page.card.efc_chain")}>
              <EfcChain pmm={pmm} pmc={pmc} />
            </Fact>
          </dl>
        </section>
      )}
    </>
  );
}
