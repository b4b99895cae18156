import { Button, Checkbox, Progress } from "@mantine/core";
import { IconPlayerStop, IconSearch } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { cancelSearch, type Search, searchQuery, signatureQuery, startSearch } from "../../../api/search";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { useTyped } from "../../../ui/useTyped";
import classes from "./Search.module.css";
import { HitTable } from "./HitTable";
import { SignatureInput } from "./SignatureInput";
import { SkippedList } from "./SkippedList";

/** All recordings looked through for a signature: an order of events, or signals beyond a number. */
export function SearchTab() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const [typed, setTyped] = useTyped(search.q ?? "", (q) => update({ q: q || undefined }));
  const [makeIndexes, setMakeIndexes] = useState(false);
  const understood = useQuery(signatureQuery(search.q ?? ""));
  const client = useQueryClient();
  const [id, setId] = useState<string | null>(null);
  const start = useMutation({
    mutationFn: () => startSearch(typed, makeIndexes),
    onSuccess: (begun) => {
      client.setQueryData(searchQuery(begun.id).queryKey, begun);
      setId(begun.id);
    },
  });
  const found = useQuery(searchQuery(id));
  const running = start.isPending || found.data?.state === "running";
  const settled = typed === (search.q ?? "");
  const ready = typed.trim() !== "" && settled && understood.isSuccess;
  return (
    <div className={room.room}>
      <form
        className={classes.tools}
        onSubmit={(event) => {
          event.preventDefault();
          if (ready && !running) start.mutate();
        }}
      >
        <h1 className={classes.title}>{t("page.search.title")}</h1>
        <SignatureInput
          text={typed}
          onText={setTyped}
          understood={settled ? understood.data : undefined}
          error={settled ? understood.error : null}
        />
        {running && found.data ? (
          <Button
            variant="default"
            leftSection={<IconPlayerStop size={17} aria-hidden />}
            onClick={() => void cancelSearch(found.data.id).then(() => found.refetch())}
            data-testid="search-cancel"
          >
            {t("page.search.cancel")}
          </Button>
        ) : (
          <Button
            type="submit"
            disabled={!ready}
            loading={start.isPending}
            leftSection={<IconSearch size={17} aria-hidden />}
            data-testid="search-start"
          >
            {t("page.search.start")}
          </Button>
        )}
        <Checkbox
          className={classes.wide ?? ""}
          label={t("page.search.make_indexes")}
          checked={makeIndexes}
          onChange={(event) => setMakeIndexes(event.currentTarget.checked)}
        />
      </form>
      {start.isError && <ProblemAlert error={start.error} title={t("page.search.failed")} />}
      {found.isError && <ProblemAlert error={found.error} title={t("page.search.failed")} />}
      {found.data && <Progressing search={found.data} />}
      <HitTable search={found.data} />
      {found.data && <SkippedList skipped={found.data.skipped} />}
    </div>
  );
}

function Progressing({ search }: { search: Search }) {
  const t = useTexts();
  const share = search.total === 0 ? 100 : (100 * search.done) / search.total;
  const facts = {
    done: search.done,
    total: search.total,
    hits: search.hits_total,
    state: t(`page.search.state.${search.state}`),
  };
  return (
    <div className={classes.progress} role="status" data-testid="search-progress" data-state={search.state}>
      <Progress value={share} aria-label={t("page.search.progress_label")} />
      <span>
        {t("page.search.progress", facts)}
        {search.more && ` ${t("page.search.more")}`}
        {search.text_key !== null && ` ${t(search.text_key, search.details)}`}
      </span>
    </div>
  );
}
