import { IconArrowRight, IconCircle, IconCircleCheckFilled, IconHelpCircle } from "@tabler/icons-react";
import { useQueries, useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { setsQuery } from "../../api/sets";
import { descriptionQuery, turbineQuery } from "../../api/queries";
import { roomSearch, usePageSearch } from "../../frame/search";
import {
  liveStore as store,
  useHearing,
  useLink,
  useNodes,
  useServerNow,
  useWatchDevice,
} from "../../live/live";
import { useTexts } from "../../texts/texts";
import { placesOf } from "../../ui/devices";
import room from "../../ui/Room.module.css";
import { type Facts, type Procedure, PROCEDURES, type Step, Tick } from "./checks";
import classes from "./Procedures.module.css";

const REFRESH_MS = 1000;

/** Checklists whose ticks come from the bus and the data folder, never from a click. */
export function ProceduresPage() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const facts = useFacts();
  const open = PROCEDURES.find((one) => one.id === search.procedure) ?? PROCEDURES[0];
  return (
    <div className={room.room}>
      {placesOf(facts.turbine).map(({ device }) => (
        <Watch key={device.slug} slug={device.slug} />
      ))}
      <div className={room.strip}>
        <h1>{t("page.rooms.procedures")}</h1>
        <span className="dim">{t("page.procedures.explain")}</span>
      </div>
      <div className={classes.body}>
        <nav className={classes.choice} aria-label={t("page.procedures.choose")}>
          {PROCEDURES.map((one) => (
            <button
              key={one.id}
              type="button"
              aria-current={one === open}
              data-testid={`procedure-${one.id}`}
              onClick={() => update({ procedure: one.id })}
            >
              <strong>{t(`page.procedures.${one.id}.title`)}</strong>
              <span className="dim">
                {t("page.procedures.progress", {
                  done: one.steps.filter((step) => step.check(facts) === Tick.Done).length,
                  total: one.steps.length,
                })}
              </span>
            </button>
          ))}
        </nav>
        {open && <Steps procedure={open} facts={facts} />}
      </div>
    </div>
  );
}

/** Keeps the values of a device coming: the ticks rest on them. */
function Watch({ slug }: { slug: string }) {
  useWatchDevice(slug);
  return null;
}

function useFacts(): Facts {
  const turbine = useQuery(turbineQuery).data;
  const ids = [...new Set(placesOf(turbine).map(({ device }) => device.description_id))];
  const docs = useQueries({ queries: ids.map((id) => descriptionQuery(id)) });
  return {
    hearing: useHearing().state === "hearing",
    link: useLink(),
    turbine,
    nodes: useNodes(),
    cellsOf: (device) => store.cells(device),
    docs: new Map(docs.flatMap(({ data }) => (data ? [[data.id, data] as const] : []))),
    sets: useQuery(setsQuery).data?.records,
    nowMs: useServerNow(REFRESH_MS),
  };
}

function Steps({ procedure, facts }: { procedure: Procedure; facts: Facts }) {
  const t = useTexts();
  const ticks = procedure.steps.map((step) => step.check(facts));
  const next = ticks.findIndex((one) => one !== Tick.Done);
  return (
    <section className={classes.steps} aria-label={t(`page.procedures.${procedure.id}.title`)}>
      <h2>{t(`page.procedures.${procedure.id}.title`)}</h2>
      <p className="dim">{t(`page.procedures.${procedure.id}.purpose`)}</p>
      <ol>
        {procedure.steps.map((step, at) => (
          <StepLine
            key={step.key}
            step={step}
            facts={facts}
            tick={ticks[at] ?? Tick.Unknown}
            next={at === next}
          />
        ))}
      </ol>
      {next < 0 && (
        <p className="tone-ok" data-testid="procedure-done">
          <IconCircleCheckFilled size={18} aria-hidden /> {t("page.procedures.all_done")}
        </p>
      )}
    </section>
  );
}

const LOOKS = {
  [Tick.Done]: { Icon: IconCircleCheckFilled, tone: "tone-ok" },
  [Tick.Open]: { Icon: IconCircle, tone: "tone-warning" },
  [Tick.Unknown]: { Icon: IconHelpCircle, tone: "dim" },
};

function StepLine({ step, facts, tick, next }: { step: Step; facts: Facts; tick: Tick; next: boolean }) {
  const t = useTexts();
  const { Icon, tone } = LOOKS[tick];
  const details = step.details?.(facts) ?? {};
  const room = step.to === "/" ? "overview" : step.to.slice(1);
  return (
    <li data-tick={tick} data-next={next} data-testid={`step-${step.key}`}>
      <Icon size={22} className={tone} aria-hidden />
      <div>
        <strong>{t(`page.procedures.step.${step.key}.title`)}</strong>
        <span className={classes.tick}>{t(`page.procedures.tick.${tick}`)}</span>
        <p>{t(`page.procedures.step.${step.key}.${tick === Tick.Done ? "done" : "todo"}`, details)}</p>
      </div>
      <Link to={step.to} search={roomSearch} className={classes.go}>
        {t(`page.rooms.${room}`)} <IconArrowRight size={15} aria-hidden />
      </Link>
    </li>
  );
}
