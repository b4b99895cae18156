import { Button, MultiSelect } from "@mantine/core";
import { IconArrowMerge } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { exchange } from "../../api/exchange";
import { recordingsQuery } from "../../api/files";
import type { RecordingRef } from "../../api/types";
import { NeedsRole } from "../../frame/NeedsRole";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import classes from "./RecordingFiles.module.css";

/** Joins it by time with other parts, or with what was recorded on other buses, so that they are replayed as one. */
export function Joining({ file, onStarted }: { file: RecordingRef; onStarted: (id: string) => void }) {
  const t = useTexts();
  const [others, setOthers] = useState<string[]>([]);
  const listed = useQuery(recordingsQuery).data?.files ?? [];
  const joining = useMutation({
    mutationFn: () => exchange.join([file.name, ...others]),
    onSuccess: ({ id }) => onStarted(id),
  });
  const names = listed
    .filter(({ name, state }) => name !== file.name && state !== "live" && state !== "unreadable")
    .map(({ name }) => name);
  return (
    <div className={classes.cut}>
      <MultiSelect
        label={t("page.files.join_with")}
        description={t("page.files.join_means")}
        value={others}
        onChange={setOthers}
        data={names}
        searchable
        clearable
        w="100%"
        data-testid="join-with"
      />
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            disabled={locked || others.length === 0}
            loading={joining.isPending}
            leftSection={<IconArrowMerge size={17} aria-hidden />}
            onClick={() => joining.mutate()}
            data-testid="join"
          >
            {t("page.files.join")}
          </Button>
        )}
      </NeedsRole>
      {joining.isError && <ProblemAlert error={joining.error} title={t("page.files.failed")} />}
    </div>
  );
}
