/** Running a test signal from the page: held like every motion; what came of it is shown and listed at once. */
import { useQueryClient } from "@tanstack/react-query";
import { runQuery, runsQuery, signals, type SignalSettings } from "../../../api/signals";
import { usePageSearch } from "../../../frame/search";
import { Control, useControl } from "../../../motion/lease";
import { useOrder } from "../../../motion/useOrder";

export function useSignalRun(device: string) {
  const { motion: line, state } = useControl();
  const [, update] = usePageSearch();
  const client = useQueryClient();
  const order = useOrder();
  const prepared = line?.prepared.some((one) => one.device === device) === true;
  const start = (settings: SignalSettings) =>
    order.mutate({
      held: true,
      work: async (one) => {
        const run = await signals.run(device, one, settings);
        client.setQueryData(runQuery(run.id).queryKey, run);
        await client.invalidateQueries({ queryKey: runsQuery(device).queryKey });
        update({ run: run.id });
      },
    });
  return {
    start,
    error: order.error,
    prepared,
    own: state === Control.Own,
    ready: state === Control.Own && prepared,
    busy: order.isPending || line?.running != null,
    active: line?.running?.device === device && line.running.doing === "signal",
  };
}
