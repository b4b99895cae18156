import { useTexts } from "../../texts/texts";
import { useReading } from "../../ui/reading";
import type { Contexts } from "./BladeFacts";
import { bitState, CHAIN, type ChainLink, PMM } from "./layout";
import classes from "./Overview.module.css";

const STEP = 24;
const HEIGHT = 22;

interface Contact {
  link: ChainLink;
  clamp: string;
  name: string;
  /** null: not known. */
  closed: boolean | null;
}

/** The contacts of the emergency feather command through one blade, as the devices report them. */
export function EfcChain({ pmm, pmc }: Contexts) {
  const t = useTexts();
  const inputs = useReading(pmm, "30FD", "slow");
  const outputs = useReading(pmm, "30FE:03", "slow");
  const axisOutputs = useReading(pmc, "60FE:03", "slow");
  const axisInputs = useReading(pmc, "60FD", "slow");
  const stale = [inputs, outputs, axisOutputs, axisInputs].some((one) => one?.stale ?? true);
  const contacts = CHAIN.map((link): Contact => {
    const context = link.on === PMM ? pmm : pmc;
    const state = context && bitState(context, link.address, link.bit);
    return {
      link,
      clamp: state?.bit.clamp ?? "",
      name: state ? t(state.bit.text_key) : "",
      closed: state?.set ?? null,
    };
  });
  const open = contacts.filter((one) => one.closed === false);
  const unknown = contacts.some((one) => one.closed === null);
  const state = open.length > 0 ? "open" : unknown ? "unknown" : "closed";
  const words = t(`page.efc.${state}`, { clamps: open.map((one) => one.clamp.split("/")[0]).join(", ") });
  return (
    <span className={classes.chain} data-state={state} data-stale={stale} data-testid="efc-chain">
      <svg
        viewBox={`0 0 ${STEP * contacts.length} ${HEIGHT}`}
        width={STEP * contacts.length}
        height={HEIGHT}
        aria-hidden
      >
        {contacts.map((one, at) => (
          <ContactMark key={one.link.key} contact={one} x={at * STEP} title={contactTitle(one, t)} />
        ))}
      </svg>
      <span>{words}</span>
      <span className="visually-hidden">{contacts.map((one) => contactTitle(one, t)).join("; ")}</span>
    </span>
  );
}

function contactTitle({ clamp, name, closed }: Contact, t: ReturnType<typeof useTexts>): string {
  return t(`page.efc.contact_${closed === null ? "unknown" : closed ? "closed" : "open"}`, { clamp, name });
}

/** A make contact: a bridge while closed, an arm that stands off while open, dots while nobody knows. */
function ContactMark({ contact, x, title }: { contact: Contact; x: number; title: string }) {
  const y = 15;
  const state = contact.closed === null ? "unknown" : contact.closed ? "closed" : "open";
  return (
    <g transform={`translate(${x} 0)`} className={classes.contact} data-state={state}>
      <title>{title}</title>
      <rect width={STEP} height={HEIGHT} fill="transparent" />
      <line x1={0} y1={y} x2={4} y2={y} />
      <line x1={20} y1={y} x2={STEP} y2={y} />
      <line
        x1={5}
        y1={y}
        x2={19}
        y2={state === "open" ? 4 : y}
        strokeDasharray={state === "unknown" ? "2 4" : undefined}
      />
      <circle cx={5} cy={y} r={2.4} />
      <circle cx={19} cy={y} r={2.4} />
    </g>
  );
}
