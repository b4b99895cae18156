import { useMemo } from "react";
import { useDerived } from "../../live/live";
import { fieldOf } from "../../model/bits";
import type { DeviceContext } from "../../model/shown";
import { type Translate, useTexts } from "../../texts/texts";
import { ReadingText } from "../../ui/ReadingText";
import { entriesOf } from "../../ui/reading";
import { Fact } from "../overview/BladeFacts";
import overview from "../overview/Overview.module.css";
import classes from "./Axis.module.css";

const INPUTS = "3242";
const OUTPUTS = "3252";
/** The first bit of 60FDh that a routing feeds stands in sub-index 1. */
const FIRST = 1;

/** From where the bits of the inputs and the outputs come, where the drive routes them. */
export function Routing({ context }: { context: DeviceContext | null }) {
  const t = useTexts();
  if (context === null) return null;
  return (
    <>
      <Table
        context={context}
        index={INPUTS}
        title={t("page.axis.routing_in")}
        nameOf={(sub) => t("page.axis.routing_bit", { bit: sub - FIRST })}
      />
      <Table
        context={context}
        index={OUTPUTS}
        title={t("page.axis.routing_out")}
        nameOf={(sub) => t("page.axis.routing_output", { output: sub })}
      />
    </>
  );
}

interface TableProps {
  context: DeviceContext;
  index: string;
  title: string;
  nameOf: (sub: number) => string;
}

/** What is fed by something; a place that is always 0 says nothing. */
function Table({ context, index, title, nameOf }: TableProps) {
  const t = useTexts();
  const { doc, slug, lookup } = context;
  const entries = useMemo(
    () =>
      [...entriesOf(doc).keys()].filter(
        (address) => address.startsWith(`${index}:`) && address !== `${index}:00`,
      ),
    [doc, index],
  );
  const fed = useDerived(
    entries.map((address) => `value:${slug}/${address}`),
    () => entries.filter((address) => lookup(address) !== 0),
  );
  if (entries.length === 0) return null;
  return (
    <section
      className={`${classes.panel} ${classes.plots}`}
      aria-label={title}
      data-testid={`routing-${index}`}
    >
      <h2>{title}</h2>
      {fed.length === 0 && <p className="dim">{t("page.axis.routing_none")}</p>}
      <dl className={overview.facts}>
        {fed.map((address) => (
          <Fact key={address} name={nameOf(parseInt(address.slice(-2), 16))}>
            <ReadingText
              context={context}
              address={address}
              pace="kept"
              instead={(raw) => fieldsOf(context, address, raw, t)}
            />
          </Fact>
        ))}
      </dl>
    </section>
  );
}

/** Fields of several bits by their names and values; null where the value has a name of its own. */
function fieldsOf(context: DeviceContext, address: string, raw: number, t: Translate): string | null {
  const entry = entriesOf(context.doc).get(address);
  const bits = entry?.bits ? context.doc.bit_tables[entry.bits] : undefined;
  if (!entry || !bits) return null;
  return bits.map((bit) => `${t(bit.text_key)} ${fieldOf(entry, raw, bit)}`).join(" · ");
}
