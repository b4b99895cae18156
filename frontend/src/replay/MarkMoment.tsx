import { Button } from "@mantine/core";
import { IconBookmarkPlus, IconBookmarkFilled } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { lazy, Suspense, useEffect, useEffectEvent, useState } from "react";
import { incidentQuery } from "../api/incidents";
import type { ReplayDoc } from "../api/replay";
import { NeedsRole } from "../frame/NeedsRole";
import { useRole } from "../frame/role";
import { type PageSearch, readSearch, roomSearch, usePageSearch } from "../frame/search";
import { useTexts } from "../texts/texts";
import { TYPING } from "./keys";
import type { Replay } from "./opening";
import classes from "./MarkMoment.module.css";
import bar from "./Replay.module.css";

const Dialog = lazy(async () => ({ default: (await import("./MarkMomentDialog")).MarkMomentDialog }));

/** Marks the moment that is shown, from any room of a replay; beside it the incident that a link led to. */
export function MarkMoment({ doc, replay }: { doc: ReplayDoc; replay: Replay }) {
  const t = useTexts();
  const [open, setOpen] = useState(false);
  const { may } = useRole();
  useMarkKey(() => may("technician") && setOpen(true));
  useLinkedLoop(doc, replay);
  return (
    <>
      <Opened />
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            px="sm"
            className={bar.brief ?? ""}
            aria-label={t("page.mark.open")}
            disabled={locked}
            leftSection={<IconBookmarkPlus size={17} aria-hidden />}
            onClick={() => setOpen(true)}
            aria-keyshortcuts="m"
            title={locked ? undefined : t("page.mark.open_why")}
            data-testid="mark"
          >
            {t("page.mark.open")}
          </Button>
        )}
      </NeedsRole>
      {open && (
        <Suspense>
          <Dialog doc={doc} onClose={() => setOpen(false)} />
        </Suspense>
      )}
    </>
  );
}

/** The incident of the link by which the replay was opened: a step back to what was written down of it. */
function Opened() {
  const t = useTexts();
  const [{ incident: code }] = usePageSearch();
  const title = useQuery(incidentQuery(code)).data?.title;
  if (code === undefined || title === undefined) return null;
  const label = t("page.mark.incident", { title });
  return (
    <Link
      to="/recordings"
      search={(before: PageSearch) =>
        readSearch({
          ...roomSearch(before, { tab: "incidents", incident: code }),
          replay: undefined,
          at: undefined,
        })
      }
      className={classes.incident}
      title={label}
      aria-label={label}
      data-testid="opened-incident"
    >
      <IconBookmarkFilled size={16} aria-hidden />
      <span>{title}</span>
    </Link>
  );
}

function useMarkKey(mark: () => void): void {
  const hear = useEffectEvent((event: KeyboardEvent) => {
    const { target, key } = event;
    if (key !== "m" || event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (!(target instanceof Element) || target.closest(TYPING)) return;
    event.preventDefault();
    mark();
  });
  useEffect(() => {
    const listener = (event: KeyboardEvent) => hear(event);
    window.addEventListener("keydown", listener);
    return () => window.removeEventListener("keydown", listener);
  }, []);
}

/** Loops the stretch of the link, once; where others look at this replay nothing of theirs is changed. */
function useLinkedLoop(doc: ReplayDoc, { transport }: Replay): void {
  const [{ loop }, update] = usePageSearch();
  const take = useEffectEvent((text: string) => {
    const [from_ns = NaN, to_ns = NaN] = text.split("-").map(Number);
    if (from_ns < to_ns && doc.watchers === 0) transport.setLoop({ from_ns, to_ns });
    update({ loop: undefined });
  });
  useEffect(() => {
    if (loop !== undefined) take(loop);
  }, [loop]);
}
