import { Button } from "@mantine/core";
import { useCallback } from "react";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import classes from "./Bus.module.css";
import { isFiltered, NO_FILTER } from "./filter";
import { FrameDetail } from "./FrameDetail";
import { TraceStatus } from "./TraceStatus";
import { TraceTable } from "./TraceTable";
import { TraceTools } from "./TraceTools";
import { useTrace } from "./useTrace";

/** The frames as they come, filtered; paused it is a window over all that is kept. */
export function TraceView() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const trace = useTrace();
  const { view, paused, pause } = trace;
  const { rows } = view;
  const picked = rows.find((row) => row.t_ns === trace.wanted);
  const pick = useCallback(
    (tNs: number | null) => {
      if (tNs !== null) pause();
      update({ frame: tNs === null ? undefined : BigInt(tNs).toString(), paused: "1" });
    },
    [pause, update],
  );
  return (
    <>
      <TraceTools trace={trace} />
      <TraceTable
        rows={rows}
        following={!paused}
        picked={trace.wanted}
        query={search.q ?? ""}
        onPick={pick}
        onLeave={pause}
        onOlder={trace.older}
        onNewer={paused && view.newer ? trace.newer : null}
      >
        {rows.length === 0 && !trace.fetching && (
          <div className={classes.empty}>
            <p>{t(isFiltered(search) ? "trace.page.none_match" : "trace.page.none")}</p>
            {isFiltered(search) && (
              <Button variant="default" onClick={() => update(NO_FILTER)}>
                {t("trace.page.clear_filter")}
              </Button>
            )}
          </div>
        )}
      </TraceTable>
      {picked && <FrameDetail line={picked} rows={rows} onPick={pick} />}
      <TraceStatus trace={trace} />
    </>
  );
}
