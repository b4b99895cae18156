import { Button, FileButton } from "@mantine/core";
import { IconPackageImport } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useRef } from "react";
import { incidentKeys, incidents, type IncidentTaken } from "../../../api/incidents";
import { recordingsQuery } from "../../../api/files";
import { queryClient } from "../../../api/queries";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import classes from "./Incidents.module.css";
import { Dialog } from "../../../ui/Dialog";

/** Opens an incident that came as a file: what of it was taken, and all that was not. */
export function TakeBundle({ onTaken }: { onTaken: (code: string) => void }) {
  const t = useTexts();
  const forget = useRef<() => void>(null);
  const taking = useMutation({
    mutationFn: incidents.take,
    // The same file may be chosen again.
    onSettled: () => forget.current?.(),
    onSuccess: async (taken) => {
      await queryClient.invalidateQueries(incidentKeys);
      await queryClient.invalidateQueries({ queryKey: recordingsQuery.queryKey });
      if (taken.incident) onTaken(taken.incident.code);
    },
  });
  return (
    <>
      <NeedsRole role="technician">
        {(locked) => (
          <FileButton
            resetRef={forget}
            onChange={(file) => file && taking.mutate(file)}
            inputProps={{ "aria-hidden": true, tabIndex: -1 }}
          >
            {({ onClick }) => (
              <Button
                variant="default"
                disabled={locked}
                loading={taking.isPending}
                leftSection={<IconPackageImport size={17} aria-hidden />}
                onClick={onClick}
                data-testid="take-bundle"
              >
                {t("page.incidents.take")}
              </Button>
            )}
          </FileButton>
        )}
      </NeedsRole>
      <Dialog
        opened={taking.data !== undefined || taking.isError}
        onClose={() => taking.reset()}
        title={t("page.incidents.taken.title")}
        size="lg"
      >
        {taking.isError && <ProblemAlert error={taking.error} title={t("page.incidents.taken.failed")} />}
        {taking.data && <Taken taken={taking.data} />}
      </Dialog>
    </>
  );
}

function Taken({ taken }: { taken: IncidentTaken }) {
  const t = useTexts();
  const { incident, recording, annotations, sets, flaws, lacking } = taken;
  const known = taken.new ? "page.incidents.taken.new" : "page.incidents.taken.known";
  return (
    <div className={classes.taken} data-testid="taken">
      <p>
        <strong>
          {incident === null ? t("page.incidents.taken.no_incident") : t(known, { title: incident.title })}
        </strong>
      </p>
      <ul>
        <li>
          {recording === null
            ? t("page.incidents.taken.no_recording")
            : t("page.incidents.taken.recording", { recording })}
        </li>
        <li>{t("page.incidents.taken.more", { annotations, sets })}</li>
        {lacking.map((key) => (
          <li key={key} className="tone-warning">
            {t(key)}
          </li>
        ))}
        {flaws.map((flaw) => (
          <li key={`${flaw.member} ${flaw.reason_key}`} className="tone-error">
            <strong>{flaw.member}</strong> {t(flaw.reason_key, { detail: flaw.detail })}
          </li>
        ))}
      </ul>
    </div>
  );
}
