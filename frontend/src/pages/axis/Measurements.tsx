import { useTexts } from "../../texts/texts";
import { ReadingText } from "../../ui/ReadingText";
import type { Pace } from "../../ui/reading";
import { BladeFacts, type Contexts, Fact } from "../overview/BladeFacts";
import { EfcChain } from "../overview/EfcChain";
import overview from "../overview/Overview.module.css";
import classes from "./Axis.module.css";

/** Objects of the axis controller: name, address and how often it is read. */
const MOTION: readonly { key: string; address: string; pace: Pace }[] = [
  { key: "mode", address: "6061", pace: "slow" },
  { key: "position", address: "6064", pace: "fast" },
  { key: "target", address: "607A", pace: "slow" },
  { key: "following_error", address: "60F4", pace: "slow" },
  { key: "blade_encoder", address: "6864", pace: "rare" },
  { key: "velocity", address: "606C", pace: "fast" },
  { key: "current", address: "6078", pace: "slow" },
  { key: "dc_link", address: "6079", pace: "slow" },
];

export function Measurements({ pmm, pmc }: Contexts) {
  const t = useTexts();
  return (
    <>
      <section className={classes.panel} aria-label={t("page.axis.motion")}>
        <h2>{t("page.axis.motion")}</h2>
        <dl className={overview.facts}>
          {MOTION.map(({ key, address, pace }) => (
            <Fact key={key} name={t(`page.axis.quantity.${key}`)}>
              <ReadingText context={pmc} address={address} pace={pace} />
            </Fact>
          ))}
        </dl>
      </section>
      <section className={classes.panel} aria-label={t("page.axis.power")}>
        <h2>{t("page.axis.power")}</h2>
        <dl className={overview.facts}>
          <BladeFacts pmm={pmm} pmc={pmc} />
          <Fact name={t("page.card.efc_chain")}>
            <EfcChain pmm={pmm} pmc={pmc} />
          </Fact>
        </dl>
      </section>
    </>
  );
}
