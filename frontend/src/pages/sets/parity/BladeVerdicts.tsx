import { IconCircleCheck, IconEqualNot, IconFileOff } from "@tabler/icons-react";
import { useTexts } from "../../../texts/texts";
import type { Compared } from "../compare/compared";
import { useColumnTitle } from "../compare/titles";
import { Verdict } from "../compare/Verdict";
import classes from "./Parity.module.css";
import { type BladeVerdict, verdictsOf } from "./verdicts";

/** The sentence that sums up, and for each blade whether it is the odd one. */
export function BladeVerdicts({ compared, without }: { compared: Compared; without: readonly number[] }) {
  const t = useTexts();
  const { columns, rows, summary } = compared.doc;
  return (
    <>
      <Verdict summary={summary} />
      <ul className={classes.blades}>
        {verdictsOf(columns, rows).map((verdict) => (
          <Blade key={verdict.column.spec} verdict={verdict} />
        ))}
        {without.map((blade) => (
          <li key={blade} data-odd data-testid={`parity-without-${blade}`}>
            <IconFileOff size={20} className="tone-warning" aria-hidden />
            <strong>{t("page.blade", { blade })}</strong>
            <span>{t("page.parity.without")}</span>
          </li>
        ))}
      </ul>
    </>
  );
}

function Blade({ verdict }: { verdict: BladeVerdict }) {
  const t = useTexts();
  const { place } = useColumnTitle()(verdict.column, false);
  const { alone, discord } = verdict;
  const odd = alone + discord > 0;
  const Icon = odd ? IconEqualNot : IconCircleCheck;
  const said = [
    alone > 0 && t(alone === 1 ? "page.parity.alone_one" : "page.parity.alone_many", { count: alone }),
    discord > 0 &&
      t(discord === 1 ? "page.parity.discord_one" : "page.parity.discord_many", { count: discord }),
  ].filter(Boolean);
  return (
    <li data-odd={odd} data-testid={`parity-${verdict.column.device}`}>
      <Icon size={20} className={odd ? "tone-warning" : "tone-ok"} aria-hidden />
      <strong>{place}</strong>
      <span>{odd ? said.join(", ") : t("page.parity.agrees")}</span>
    </li>
  );
}
