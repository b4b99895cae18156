import { Button, Switch, TextInput } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { useState } from "react";
import { queryClient } from "../../../api/queries";
import { keepMoment, type MomentSet } from "../../../api/replay";
import { setsQuery } from "../../../api/sets";
import { NeedsRole } from "../../../frame/NeedsRole";
import { type PageSearch, roomSearch } from "../../../frame/search";
import { useStore } from "../../../live/live";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { dayAndTime } from "../../../ui/format";
import own from "./Parameters.module.css";
import { Dialog } from "../../../ui/Dialog";

interface Props {
  replay: string;
  device: string;
  devices: readonly (readonly [slug: string, title: string])[];
  onClose: () => void;
}

/** Keeps what was in force at the cursor as sets of the library. They are restored live, never here. */
export function SaveMoment({ replay, device, devices, onClose }: Props) {
  const t = useTexts();
  const store = useStore();
  const [tNs] = useState(() => store.cursor?.t_ns ?? 0);
  const [reason, setReason] = useState("");
  const [all, setAll] = useState(false);
  const chosen = all ? devices.map(([slug]) => slug) : [device];
  const keeping = useMutation({
    mutationFn: () => keepMoment(replay, chosen, tNs, reason),
    onSuccess: () => queryClient.invalidateQueries({ queryKey: setsQuery.queryKey }),
  });
  const title = devices.find(([slug]) => slug === device)?.[1] ?? device;
  return (
    <Dialog opened onClose={onClose} title={t("desk.keep_title", { time: dayAndTime(tNs / 1e6) })}>
      {keeping.data ? (
        <Kept sets={keeping.data} />
      ) : (
        <form
          className={own.form}
          onSubmit={(event) => {
            event.preventDefault();
            keeping.mutate();
          }}
        >
          <p>{t("desk.keep_means")}</p>
          <Switch
            label={t("desk.keep_all", { count: devices.length, device: title })}
            checked={all}
            onChange={(event) => setAll(event.currentTarget.checked)}
          />
          <TextInput
            label={t("desk.keep_reason")}
            value={reason}
            onChange={(event) => setReason(event.currentTarget.value)}
            data-autofocus
            data-testid="keep-reason"
          />
          {keeping.isError && <ProblemAlert error={keeping.error} title={t("desk.keep_failed")} />}
          <NeedsRole role="technician">
            {(locked) => (
              <Button type="submit" disabled={locked} loading={keeping.isPending} data-testid="keep-now">
                {t("desk.keep")}
              </Button>
            )}
          </NeedsRole>
        </form>
      )}
    </Dialog>
  );
}

function Kept({ sets }: { sets: readonly MomentSet[] }) {
  const t = useTexts();
  const stationOf = ({ device }: MomentSet) => device.slice(0, device.lastIndexOf("/"));
  const stations = [...new Set(sets.map(stationOf))];
  return (
    <div className={own.form} data-testid="kept">
      <ul>
        {sets.map((one) => (
          <li key={one.id}>{t("desk.kept", { device: one.device, known: one.known, unseen: one.unseen })}</li>
        ))}
      </ul>
      <p>{t("desk.kept_next")}</p>
      {stations.map((station) => (
        <Link
          key={station}
          to="/sets"
          className={own.link}
          search={(before: PageSearch) =>
            restoreSearch(
              before,
              station,
              sets.filter((one) => stationOf(one) === station),
            )
          }
        >
          {t("desk.to_restore", { station })}
        </Link>
      ))}
    </div>
  );
}

/** Outside of the replay: it is the turbine that is restored. */
function restoreSearch(before: PageSearch, station: string, sets: readonly MomentSet[]): PageSearch {
  const search = roomSearch(before, { tab: "restore", station, sets: sets.map((one) => one.id).join() });
  delete search.replay;
  delete search.at;
  return search;
}
