import { Button } from "@mantine/core";
import { IconLock, IconPlayerPlay, IconPlayerStop, IconTarget } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { queryClient } from "../../../api/queries";
import { isArmed, type ScopeLine, scopeKeys, scopeOrders } from "../../../api/scope";
import { useTexts } from "../../../texts/texts";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";
import { type Draft, orderOf } from "./draft";
import classes from "./Scope.module.css";

interface Props {
  line: ScopeLine | undefined;
  draft: Draft;
  chosen: readonly string[];
  replayed: boolean;
  /** Why this person may not arm it; null where they may. */
  why: string | null;
  locked: boolean;
  onArmed: () => void;
}

/** What the scope does, and the buttons that change it. */
export function ScopeControl({ line, draft, chosen, replayed, why, locked, onArmed }: Props) {
  const t = useTexts();
  const armed = isArmed(line);
  const order = orderOf(draft, chosen);
  const failed = (error: unknown) => {
    const story = storyOf(error, t);
    notify({ tone: "error", title: t("page.scope.arm_failed"), lines: [story.happened, story.next] });
  };
  const refresh = () => queryClient.invalidateQueries(scopeKeys);
  const arming = useMutation({
    mutationFn: async () => order && scopeOrders.arm(order),
    onSuccess: onArmed,
    onError: failed,
    onSettled: refresh,
  });
  const triggering = useMutation({ mutationFn: scopeOrders.trigger, onError: failed, onSettled: refresh });
  const stopping = useMutation({ mutationFn: scopeOrders.stop, onError: failed, onSettled: refresh });
  return (
    <>
      {!replayed && (
        <p className={classes.state} role="status" data-phase={line?.phase} data-testid="scope-state">
          <i aria-hidden />
          <span>
            <strong>{t(stateOf(line))}</strong>
            <small className="dim">{line ? factsOf(line, t) : ""}</small>
            {armed && line && <Filled line={line} />}
          </span>
        </p>
      )}
      {replayed ? (
        <span className={classes.lock} data-testid="scope-lock">
          <IconLock size={17} aria-hidden /> {t("page.scope.locked")}
        </span>
      ) : (
        <div
          className={classes.buttons}
          title={why ?? (order === null ? t("page.scope.arm_missing") : undefined)}
        >
          <Button
            leftSection={<IconTarget size={18} aria-hidden />}
            disabled={locked || order === null || arming.isPending}
            onClick={() => arming.mutate()}
            data-testid="arm"
          >
            {t(armed ? "page.scope.arm_again" : "page.scope.arm")}
          </Button>
          <Button
            variant="default"
            leftSection={<IconPlayerPlay size={18} aria-hidden />}
            disabled={locked || line?.phase !== "waiting"}
            onClick={() => triggering.mutate()}
            data-testid="trigger-now"
          >
            {t("page.scope.trigger_now")}
          </Button>
          <Button
            variant="default"
            leftSection={<IconPlayerStop size={18} aria-hidden />}
            disabled={locked || !armed}
            onClick={() => stopping.mutate()}
            data-testid="scope-stop"
          >
            {t("page.scope.stop")}
          </Button>
          {why !== null && <span className="dim">{why}</span>}
        </div>
      )}
    </>
  );
}

/** How much of the time before the trigger has been seen, and of the capture that is under way; 0 to 1. */
function shareOf(line: ScopeLine): number {
  if (line.trigger_ns !== null && line.end_ns !== null) {
    const startNs = line.trigger_ns - (line.order?.pre_s ?? 0) * 1e9;
    return Math.min(1, (line.now_ns - startNs) / Math.max(1, line.end_ns - startNs));
  }
  return Math.min(
    1,
    (line.now_ns - (line.armed_ns ?? line.now_ns)) / Math.max(1, (line.order?.pre_s ?? 0) * 1e9),
  );
}

function stateOf(line: ScopeLine | undefined): string {
  if (line?.phase === "waiting" && shareOf(line) < 1) return "page.scope.state_filling";
  return `page.scope.state_${line?.phase ?? "idle"}`;
}

function Filled({ line }: { line: ScopeLine }) {
  const t = useTexts();
  const percent = Math.round(100 * shareOf(line));
  const label = t(line.phase === "capturing" ? "page.scope.share_capture" : "page.scope.share_pre", {
    percent,
  });
  return (
    <span className={classes.filled} title={label}>
      <progress max={100} value={percent} aria-label={label} data-testid="scope-filled" />
    </span>
  );
}

function factsOf(line: ScopeLine, t: ReturnType<typeof useTexts>): string {
  const count = line.captures.length;
  const facts = [
    line.reason_key === null ? "" : t(line.reason_key),
    count === 0
      ? ""
      : t(count === 1 ? "page.scope.state_captures_one" : "page.scope.state_captures", { count }),
    isArmed(line) ? t("page.scope.state_memory", { percent: Math.ceil(100 * line.filled) }) : "",
    line.unreadable === 0 ? "" : t("page.scope.state_unreadable", { count: line.unreadable }),
    line.late === 0 ? "" : t("page.scope.state_late", { count: line.late }),
    line.person === "" ? "" : t("page.scope.state_by", { person: line.person }),
  ];
  return facts.filter((one) => one !== "").join(" · ");
}
