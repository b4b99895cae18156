import { Button, PasswordInput } from "@mantine/core";
import { useMutation, useQuery } from "@tanstack/react-query";
import { type SyntheticEvent, useState } from "react";
import { sessionQuery } from "../../api/queries";
import { settings, startAfresh } from "../../api/settings";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import classes from "./Settings.module.css";
import { SHORTEST } from "./UsersSection";

/** One's own password; afterwards one signs in again, everywhere. */
export function OwnPassword() {
  const t = useTexts();
  const session = useQuery(sessionQuery).data;
  const [old, setOld] = useState("");
  const [next, setNext] = useState("");
  const changing = useMutation({ mutationFn: () => settings.ownPassword(old, next), onSuccess: startAfresh });
  if ((session?.user ?? null) === null) return null;
  const ready = old !== "" && next.length >= SHORTEST;
  const submit = (event: SyntheticEvent) => {
    event.preventDefault();
    if (ready) changing.mutate();
  };
  return (
    <form className={classes.card} onSubmit={submit} data-testid="own-password">
      <h2>{t("page.settings.users.own_password")}</h2>
      <div className={classes.row} style={{ alignItems: "flex-start" }}>
        <PasswordInput
          w={220}
          label={t("page.settings.users.own_old")}
          autoComplete="current-password"
          value={old}
          onChange={(event) => setOld(event.currentTarget.value)}
        />
        <PasswordInput
          w={240}
          label={t("page.settings.users.password_new")}
          description={t("page.settings.users.password_rule", { least: SHORTEST })}
          inputWrapperOrder={["label", "input", "description", "error"]}
          autoComplete="new-password"
          value={next}
          onChange={(event) => setNext(event.currentTarget.value)}
        />
        <Button type="submit" mt={25} disabled={!ready} loading={changing.isPending}>
          {t("page.settings.users.own_set")}
        </Button>
      </div>
      {changing.error !== null && (
        <ProblemAlert error={changing.error} title={t("page.settings.users.not_changed")} />
      )}
    </form>
  );
}
