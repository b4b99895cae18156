import { IconBookmarkFilled, IconNote } from "@tabler/icons-react";
import { Button } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { annotationsQuery, incidentsQuery } from "../../../api/incidents";
import type { ReplayDoc } from "../../../api/replay";
import { useLooking } from "../../../replay/looking";
import { type Marked, useMarked } from "../../../replay/marked";
import { useReplay } from "../../../replay/opening";
import { useTexts } from "../../../texts/texts";
import { timeOfDay } from "../../../ui/format";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { useOpenIncident } from "../incidents/openIncident";
import classes from "./Desk.module.css";

const TONES = { info: "dim", warning: "tone-warning", error: "tone-error" };

/** What people wrote down of this recording: pressed, the cursor goes to its moment. */
export function Noted({ doc }: { doc: ReplayDoc }) {
  const t = useTexts();
  const marked = useMarked(doc.recording);
  const incidents = useQuery(incidentsQuery);
  const annotations = useQuery(annotationsQuery(doc.recording));
  const error = incidents.error ?? annotations.error;
  const pending = incidents.isPending || annotations.isPending;
  return (
    <>
      {error && <ProblemAlert error={error} title={t("desk.noted_failed")} />}
      {marked.length === 0 && !error && (
        <p className={classes.empty}>{t(pending ? "page.loading" : "desk.noted_none")}</p>
      )}
      <ul className={classes.noted} aria-label={t("desk.tab.noted")} data-testid="noted">
        {marked.map((one) => (
          <NotedLine key={`${one.kind} ${one.id}`} one={one} />
        ))}
      </ul>
    </>
  );
}

function NotedLine({ one }: { one: Marked }) {
  const t = useTexts();
  const looking = useLooking();
  const transport = useReplay()?.transport;
  const open = useOpenIncident();
  const { incident } = one;
  const Icon = incident ? IconBookmarkFilled : IconNote;
  return (
    <li>
      <button
        type="button"
        onClick={() => transport?.seek(one.atNs)}
        onPointerEnter={() => looking.setHover(one.atNs)}
        onPointerLeave={() => looking.setHover(null)}
        data-testid={`noted-${one.kind}`}
      >
        <Icon
          size={16}
          aria-label={t(`desk.noted_kind.${one.kind}`)}
          className={incident ? "" : TONES[one.severity]}
        />
        <span>
          <span className={classes.eventHead}>
            <span>{timeOfDay(one.atNs / 1e6)}</span>
            <span className="dim">{one.author}</span>
          </span>
          <span className={classes.notedText}>{one.text}</span>
        </span>
      </button>
      {incident && (
        <Button
          variant="subtle"
          size="compact-sm"
          onClick={() => open(incident)}
          title={t("desk.noted_open_why")}
          data-testid="noted-open"
        >
          {t("desk.noted_open")}
        </Button>
      )}
    </li>
  );
}
