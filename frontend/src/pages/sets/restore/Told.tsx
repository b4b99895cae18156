import { Checkbox, Switch } from "@mantine/core";
import {
  IconAlertTriangle,
  IconCircleCheck,
  IconListCheck,
  IconRefresh,
  IconShieldX,
  IconTool,
} from "@tabler/icons-react";
import type { PlanDoc, PlanSource, Refusal } from "../../../api/restore";
import { useRole } from "../../../frame/role";
import { categoryName } from "../../../model/saving";
import { type Translate, useTexts } from "../../../texts/texts";
import { useDeviceName } from "../../../ui/devices";
import { dateAndTime } from "../../../ui/format";
import { GivenName, isMotor } from "../motors/GivenName";
import { Findings } from "./Findings";
import { NO_TERMS, type Terms } from "./order";
import classes from "./Restore.module.css";

interface Props {
  plan: PlanDoc;
  station: string;
  confirmMin: number;
  terms: Terms;
  onTerms: (terms: Terms) => void;
}

/** What the restore will do to which blade, what speaks against it, what the rules say, and what it needs. */
export function Told(props: Props) {
  const t = useTexts();
  return (
    <div
      className={classes.told}
      tabIndex={0}
      role="region"
      aria-label={t("page.restoring.told")}
      data-testid="restore-told"
    >
      <AsExpert {...props} />
      <Refusals {...props} />
      <WhatHappens {...props} />
      <Network {...props} />
      <Needs plan={props.plan} />
      <Findings {...props} />
    </div>
  );
}

const OTHER_BLADES = "other-blades";

/** What only an expert may do is done knowingly: off until switched on, and nothing of it stays once it is off. */
function AsExpert({ terms, onTerms }: Props) {
  const t = useTexts();
  const { may } = useRole();
  if (!may("expert")) return null;
  return (
    <section>
      <Switch
        label={t("page.restoring.expert.switch")}
        description={t("page.restoring.expert.permits")}
        checked={terms.expert}
        onChange={(event) => {
          const expert = event.currentTarget.checked;
          const { restart, network } = terms;
          onTerms(expert ? { ...terms, expert } : { ...NO_TERMS, restart, network });
        }}
        data-testid="restore-expert"
      />
    </section>
  );
}

function Refusals({ plan, terms, onTerms }: Props) {
  const t = useTexts();
  if (plan.refusals.length === 0)
    return (
      <section>
        <h2 className="tone-ok" data-testid="precheck-passed">
          <IconCircleCheck size={20} aria-hidden />
          {t("page.restoring.precheck.passed")}
        </h2>
      </section>
    );
  const others = terms.othersConfirmed || plan.refusals.some((one) => one.code === OTHER_BLADES);
  return (
    <section>
      <h2 className="tone-error" role="status" data-testid="precheck-refused">
        <IconShieldX size={20} aria-hidden />
        {t("page.restoring.precheck.refused", { count: plan.refusals.length })}
      </h2>
      <ul>
        {plan.refusals.map((one) => (
          <RefusalLine key={`${one.code} ${one.device}`} refusal={one} />
        ))}
      </ul>
      {others && terms.expert && (
        <Checkbox
          mt="sm"
          label={t("page.restoring.others_confirmed")}
          checked={terms.othersConfirmed}
          onChange={(event) => onTerms({ ...terms, othersConfirmed: event.currentTarget.checked })}
          data-testid="others-confirmed"
        />
      )}
    </section>
  );
}

function RefusalLine({ refusal }: { refusal: Refusal }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  return (
    <li data-testid={`refusal-${refusal.code}`}>
      {refusal.device !== "" && <strong>{nameOf(refusal.device)}: </strong>}
      {t(refusal.text_key, refusal.details)}
    </li>
  );
}

/** In plain words and in the order in which it happens. */
function WhatHappens({ plan, station, confirmMin, terms }: Props) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const writes = countBy(plan.steps.filter((step) => step.kind === "write").map((step) => step.device));
  const saves = plan.steps.filter((step) => step.kind === "save");
  const parts = saves.filter((step) => step.category !== null);
  const homed = Object.keys(plan.needs);
  const byHand = saves.some((step) => plan.by_hand.includes(step.device));
  if (writes.size === 0) return null;
  const devices = [...new Set(saves.map((step) => nameOf(step.device)))].join(t("page.restoring.and"));
  return (
    <section data-testid="what-happens">
      <h2>
        <IconListCheck size={20} aria-hidden />
        {t("page.restoring.happens.title", { station })}
      </h2>
      <ol>
        {[...writes].map(([slug, count]) => (
          <li key={slug}>
            {t(`page.restoring.happens.write${count === 1 ? "_one" : ""}`, { count, device: nameOf(slug) })}
            {homed.includes(slug) && <small>{t("page.restoring.happens.homing")}</small>}
          </li>
        ))}
        <li>{t("page.restoring.happens.confirm", { minutes: confirmMin })}</li>
        <li>
          {parts.length === 0
            ? t("page.restoring.happens.save", { devices })
            : t("page.saving.each", {
                devices,
                categories: parts.map((step) => categoryName(step.category, t)).join(", "),
              })}
          <small>
            {t(parts.length === 0 ? "page.restoring.happens.save_all" : "page.saving.all_of_them")}
          </small>
        </li>
        {terms.restart && (
          <li>
            {t(`page.restoring.happens.restart${byHand ? "_hand" : ""}`, { devices })}
            {byHand && <small className="tone-warning">{t("page.restoring.happens.restart_hand_why")}</small>}
            {parts.length === 0 && !byHand && (
              <small className="tone-warning">{t("page.restoring.happens.restart_chain")}</small>
            )}
          </li>
        )}
        <li>{t(`page.restoring.happens.${terms.restart ? "prove" : "prove_ram"}`)}</li>
      </ol>
      <p className="dim">{t("page.restoring.happens.meanwhile", { station })}</p>
      <Sources sources={plan.sources} t={t} nameOf={nameOf} />
    </section>
  );
}

function Sources({
  sources,
  t,
  nameOf,
}: {
  sources: readonly PlanSource[];
  t: Translate;
  nameOf: (slug: string) => string;
}) {
  return (
    <ul className={classes.sources}>
      {sources.map((one) => (
        <li key={one.device}>
          {isMotor(one.record) ? (
            <GivenName given={one.record} />
          ) : (
            <>
              {t("page.restoring.source", {
                device: nameOf(one.device),
                from: one.from_device,
                time: dateAndTime(Date.parse(one.time)),
                person: one.person,
              })}
              <small>{t(`page.restoring.unit.${one.same_unit ? "same" : "other"}`)}</small>
            </>
          )}
        </li>
      ))}
    </ul>
  );
}

function Needs({ plan }: { plan: PlanDoc }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const needs = Object.entries(plan.needs);
  if (needs.length === 0 && plan.restarts.length === 0) return null;
  return (
    <section data-testid="restore-needs">
      {needs.length > 0 && (
        <>
          <h2>
            <IconTool size={20} aria-hidden />
            {t("page.restoring.needs")}
          </h2>
          <ul>
            {needs.map(([slug, list]) => (
              <li key={slug}>
                {nameOf(slug)}: {list.map((need) => t(`restore.need.${need}`)).join(", ")}
              </li>
            ))}
          </ul>
        </>
      )}
      {plan.restarts.map((slug) => (
        <p key={slug}>
          <IconRefresh size={16} aria-hidden /> {t("page.restoring.needs_restart", { device: nameOf(slug) })}
        </p>
      ))}
    </section>
  );
}

/** What decides at which address a device is found stays out until a person wants it in, and is warned of then. */
function Network({ plan, terms, onTerms }: Props) {
  const t = useTexts();
  const rows = plan.rows.filter((row) => row.restore_class === "network" && row.wanted_raw !== row.now_raw);
  const concerned = rows.filter((row) => row.treatment === "write" || row.why === "network");
  if (concerned.length === 0 && !terms.network) return null;
  return (
    <section data-testid="restore-network">
      <Switch
        label={t("page.saving.network.switch")}
        description={t("page.saving.network.what", {
          addresses: concerned.map((row) => row.address).join(", "),
        })}
        checked={terms.network}
        onChange={(event) => onTerms({ ...terms, network: event.currentTarget.checked })}
        data-testid="restore-network-switch"
      />
      {terms.network && (
        <p className="tone-warning" role="status">
          <IconAlertTriangle size={16} aria-hidden /> {t("page.saving.network.warning")}
        </p>
      )}
    </section>
  );
}

function countBy(slugs: readonly string[]): Map<string, number> {
  const counts = new Map<string, number>();
  for (const slug of slugs) counts.set(slug, (counts.get(slug) ?? 0) + 1);
  return counts;
}
