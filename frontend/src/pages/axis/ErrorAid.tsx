import { Link } from "@tanstack/react-router";
import { type PageSearch, roomSearch } from "../../frame/search";
import type { DeviceContext } from "../../model/shown";
import { type Translate, useTexts } from "../../texts/texts";
import { entriesOf, useReading } from "../../ui/reading";
import { PMC, PMM } from "../overview/layout";
import classes from "./Errors.module.css";
import { errorIn, piecesOf } from "./errorMemory";

/** The object that says what the axis does about some errors (table 47). */
export const FAULT_REACTION = "605E";
const AS_OPTION = "fault_reaction_option";

interface Props {
  code: number;
  context: DeviceContext;
  /** The other device of the station: texts name its objects too. */
  partner: DeviceContext | null;
  /** Only a warning: the device has done nothing about it yet. */
  warning?: boolean;
}

/** What an error code tells: what the device has seen, what it does about it, and what a person does first. */
export function ErrorAid({ code, context, partner, warning = false }: Props) {
  const t = useTexts();
  useReading(context, FAULT_REACTION, "slow"); // rendered anew when it changes: the reaction tells what it holds
  const error = errorIn(context.doc, code);
  const details = { number: error?.number ?? null };
  const cause = error?.cause_key == null ? t("page.aid.no_cause") : t(error.cause_key, details);
  const steps = error?.first_aid_key == null ? [] : t(error.first_aid_key, details).split("\n");
  const told = (text: string) => <ObjectText text={text} context={context} partner={partner} />;
  return (
    <div className={classes.aid} data-testid="aid">
      <dl>
        <dt>{t("page.aid.cause")}</dt>
        <dd data-testid="aid-cause">{told(cause)}</dd>
        <dt>{t("page.aid.reaction")}</dt>
        <dd data-testid="aid-reaction">
          {reactionLines(context, error?.reaction ?? null, warning, t).map((line) => (
            <p key={line}>{told(line)}</p>
          ))}
        </dd>
      </dl>
      {steps.length > 0 && (
        <div>
          <h3>{t("page.aid.first_aid")}</h3>
          <ol data-testid="aid-steps">
            {steps.map((step) => (
              <li key={step}>{told(step)}</li>
            ))}
          </ol>
        </div>
      )}
    </div>
  );
}

/** Table 48 in words, with what 605Eh holds now where it decides. */
function reactionLines(
  context: DeviceContext,
  reaction: string | null,
  warning: boolean,
  t: Translate,
): string[] {
  const { doc } = context;
  if (doc.id === PMM) return [t("page.aid.no_reaction_pmm")];
  const lines = [reaction === null ? t("page.aid.no_reaction") : toldOf(reaction, t)];
  if (reaction === AS_OPTION) lines.push(optionLine(context, t));
  if (doc.id === PMC && !warning) lines.push(t("page.aid.watchdog"));
  return lines;
}

function toldOf(reaction: string, t: Translate): string {
  const more = `page.aid.told.${reaction}`;
  return t(t.has(more) ? more : `reaction.${reaction}`);
}

function optionLine({ doc, lookup }: DeviceContext, t: Translate): string {
  const raw = lookup(FAULT_REACTION);
  if (typeof raw !== "number") return t("page.aid.option_unread");
  const enumeration = entriesOf(doc).get(FAULT_REACTION)?.enumeration ?? "";
  const named = doc.enumerations[enumeration]?.values.find((one) => one.value === raw);
  if (!named) return t("page.aid.option_odd", { raw });
  return t("page.aid.option", { raw, meaning: t(named.text_key) });
}

/** A text whose objects lead to their parameters: the device's own first, else those of its partner. */
function ObjectText({
  text,
  context,
  partner,
}: {
  text: string;
  context: DeviceContext;
  partner: DeviceContext | null;
}) {
  const t = useTexts();
  const owner = (address: string) =>
    [context, partner].find((one) => one !== null && entriesOf(one.doc).has(address)) ?? null;
  return piecesOf(text, (address) => owner(address) !== null).map((piece, at) => {
    const holder = piece.address === null ? null : owner(piece.address);
    if (piece.address === null || !holder) return piece.text;
    const { address } = piece;
    const name = t.nameOf(entriesOf(holder.doc).get(address)?.title ?? "");
    return (
      <Link
        key={at}
        to="/parameters"
        search={(before: PageSearch) => roomSearch(before, { device: holder.slug, edit: address })}
        className={classes.object}
        title={t("page.aid.to_object", { address, device: holder.doc.name, name })}
      >
        {piece.text}
      </Link>
    );
  });
}
