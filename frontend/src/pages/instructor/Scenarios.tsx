import { Button, Loader } from "@mantine/core";
import { IconEye, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { instructing, type Scenario, scenariosQuery } from "../../api/instructor";
import type { InstructorData } from "../../api/types";
import { NeedsRole } from "../../frame/NeedsRole";
import { usePageSearch } from "../../frame/search";
import { type Translate, useTexts } from "../../texts/texts";
import { clock } from "../../ui/format";
import { ProblemAlert } from "../../ui/ProblemAlert";
import classes from "./Instructor.module.css";
import { scenarioTitle } from "./names";

/** Exercises that play by themselves: what happens, how long it takes, what to watch. */
export function Scenarios({ line }: { line: InstructorData }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const found = useQuery(scenariosQuery);
  if (found.isError && !found.data) {
    return (
      <div className={classes.problem}>
        <ProblemAlert error={found.error} title={t("page.instructor.scenarios_failed")} />
        <Button mt="sm" onClick={() => void found.refetch()}>
          {t("page.instructor.again")}
        </Button>
      </div>
    );
  }
  if (!found.data) return <Loader m="md" aria-label={t("page.loading")} />;
  if (found.data.length === 0) {
    return (
      <div className={classes.problem} data-testid="no-scenario">
        <strong>{t("page.instructor.no_scenario")}</strong>
        <p className="dim">{t("page.instructor.no_scenario_next")}</p>
      </div>
    );
  }
  const chosen = found.data.find(({ name }) => name === search.scenario) ?? found.data[0];
  return (
    <div className={classes.body}>
      <div className={classes.choice}>
        <nav className={classes.kinds} aria-label={t("page.instructor.scenarios")}>
          {found.data.map((one) => (
            <button
              key={one.name}
              type="button"
              aria-current={one === chosen}
              onClick={() => update({ scenario: one.name })}
              data-testid={`scenario-${one.name}`}
            >
              {scenarioTitle(one.name, one.title, t)}
              <span className="dim">{clock(one.duration_s * 1000)}</span>
            </button>
          ))}
        </nav>
      </div>
      {chosen && <Details key={chosen.name} scenario={chosen} line={line} />}
    </div>
  );
}

function Details({ scenario, line }: { scenario: Scenario; line: InstructorData }) {
  const t = useTexts();
  const play = useMutation({ mutationFn: instructing.play });
  const { name, seed } = scenario;
  const title = scenarioTitle(name, scenario.title, t);
  const watch = watchText(scenario, t);
  return (
    <section className={classes.form} aria-label={title} data-testid="scenario">
      <h2>{title}</h2>
      {t.has(`scenario.${name}.about`) && <p className={classes.hint}>{t(`scenario.${name}.about`)}</p>}
      {watch !== "" && (
        <div className={classes.watch}>
          <IconEye size={19} aria-hidden />
          <div>
            <strong>{t("page.instructor.watch")}</strong>
            <p>{watch}</p>
          </div>
        </div>
      )}
      <dl className={classes.facts}>
        <dt>{t("page.instructor.duration")}</dt>
        <dd>{clock(scenario.duration_s * 1000)}</dd>
        <dt>{t("page.instructor.seed")}</dt>
        <dd>{seed}</dd>
      </dl>
      <div className={classes.go}>
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              color="var(--hs-twin)"
              leftSection={<IconPlayerPlay size={18} aria-hidden />}
              disabled={locked || !line.answering || line.playing?.scenario === name}
              loading={play.isPending}
              onClick={() => play.mutate(name)}
              data-testid="play"
            >
              {t(`page.instructor.${playWord(line, name)}`)}
            </Button>
          )}
        </NeedsRole>
        <span className="dim">{t("page.instructor.play_hint")}</span>
      </div>
      {play.error !== null && (
        <ProblemAlert error={play.error} title={t("page.instructor.play_failed", { title })} />
      )}
    </section>
  );
}

function playWord({ playing }: InstructorData, name: string): "play" | "play_instead" | "plays_now" {
  if (playing === null) return "play";
  return playing.scenario === name ? "plays_now" : "play_instead";
}

/** What to watch, in the language of the page where the catalogue has it; else what the file says. */
function watchText({ name, note }: Scenario, t: Translate): string {
  const key = `scenario.${name}.watch`;
  return t.has(key) ? t(key) : note;
}
