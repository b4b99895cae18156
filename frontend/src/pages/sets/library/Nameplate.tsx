import { Button, TextInput } from "@mantine/core";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { queryClient } from "../../../api/queries";
import { library, nameplatesQuery } from "../../../api/sets";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { dayAndTime } from "../../../ui/format";
import classes from "./Library.module.css";

const LONGEST = 40;

/** The serial number on the plate of a device that tells none: typed twice, so that a slip is noticed. */
export function Nameplate({ device }: { device: string }) {
  const t = useTexts();
  const known = useQuery(nameplatesQuery).data?.find((one) => one.device === device);
  const [serial, setSerial] = useState("");
  const [again, setAgain] = useState("");
  const typing = useMutation({
    mutationFn: () => library.typeNameplate(device, serial, again),
    onSuccess: () => {
      setSerial("");
      setAgain("");
      return queryClient.invalidateQueries({ queryKey: nameplatesQuery.queryKey });
    },
  });
  const differs = again !== "" && serial.trim() !== again.trim();
  return (
    <div data-testid="nameplate">
      <h3>{t("page.sets.nameplate.title")}</h3>
      <p className={classes.plain}>
        {known
          ? t("page.sets.nameplate.known", {
              serial: known.serial,
              person: known.person,
              time: dayAndTime(known.t_ns / 1e6),
            })
          : t("page.sets.nameplate.unknown")}
      </p>
      <form
        className={classes.plate}
        onSubmit={(event) => {
          event.preventDefault();
          typing.mutate();
        }}
      >
        <TextInput
          label={t("page.sets.nameplate.serial")}
          value={serial}
          maxLength={LONGEST}
          onChange={(event) => setSerial(event.currentTarget.value)}
          data-testid="plate-serial"
        />
        <TextInput
          label={t("page.sets.nameplate.again")}
          value={again}
          maxLength={LONGEST}
          error={differs ? t("page.sets.nameplate.differs") : undefined}
          onPaste={(event) => event.preventDefault()}
          onChange={(event) => setAgain(event.currentTarget.value)}
          data-testid="plate-again"
        />
        <NeedsRole role="technician">
          {(locked) => (
            <Button
              type="submit"
              variant="default"
              disabled={locked || serial.trim() === "" || again === "" || differs}
              loading={typing.isPending}
              data-testid="plate-keep"
            >
              {t("page.sets.nameplate.keep")}
            </Button>
          )}
        </NeedsRole>
      </form>
      {typing.isError && <ProblemAlert error={typing.error} title={t("page.sets.nameplate.failed")} />}
    </div>
  );
}
