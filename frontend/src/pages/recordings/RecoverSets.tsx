import { Button } from "@mantine/core";
import { IconFileSearch } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { queryClient } from "../../api/queries";
import { library, type Recovered, setsQuery } from "../../api/sets";
import { NeedsRole } from "../../frame/NeedsRole";
import { type PageSearch, roomSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import room from "../../ui/Room.module.css";

/** What the SDO traffic of a recording showed of each device, taken into the library as sets. */
export function RecoverSets({ name }: { name: string }) {
  const t = useTexts();
  const recovering = useMutation({
    mutationFn: () => library.recover(name),
    onSuccess: () => queryClient.invalidateQueries({ queryKey: setsQuery.queryKey }),
  });
  return (
    <div>
      <h3>{t("page.rooms.sets")}</h3>
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            disabled={locked}
            loading={recovering.isPending}
            leftSection={<IconFileSearch size={17} aria-hidden />}
            onClick={() => recovering.mutate()}
            data-testid="recover-sets"
          >
            {t("page.sets.recover")}
          </Button>
        )}
      </NeedsRole>
      {recovering.isError && <ProblemAlert error={recovering.error} title={t("page.sets.recover_failed")} />}
      {recovering.data && <Found found={recovering.data} />}
    </div>
  );
}

function Found({ found }: { found: Recovered }) {
  const t = useTexts();
  return (
    <div role="status" data-testid="recovered-sets">
      {found.sets.length === 0 && <p>{t("page.sets.recovered_none")}</p>}
      <ul className={room.list}>
        {found.sets.map((one) => (
          <li key={one.record.id}>
            <span>
              {t("page.sets.recovered", {
                device: one.record.origin.device,
                read: one.read,
                written: one.written,
              })}
              {one.doubtful > 0 && (
                <span className="tone-warning">
                  {" "}
                  {t("page.sets.recovered_doubtful", { count: one.doubtful })}
                </span>
              )}
            </span>
            <Link
              to="/sets"
              search={(before: PageSearch) => roomSearch(before, { file: one.record.id })}
              className={room.link}
            >
              {t("page.sets.recovered_open")}
            </Link>
          </li>
        ))}
        {found.nameless.map((one) => (
          <li key={`${one.bus} ${one.node}`}>{t("page.sets.recovered_nameless", { ...one })}</li>
        ))}
      </ul>
      {found.damages > 0 && (
        <p className="tone-error">{t("page.sets.recovered_damages", { count: found.damages })}</p>
      )}
    </div>
  );
}
