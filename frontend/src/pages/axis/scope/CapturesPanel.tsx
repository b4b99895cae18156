import { Button, Checkbox, TextInput } from "@mantine/core";
import { IconFilter } from "@tabler/icons-react";
import { useState } from "react";
import type { CaptureLine } from "../../../api/scope";
import { useTexts } from "../../../texts/texts";
import { dayAndTime } from "../../../ui/format";
import classes from "./Scope.module.css";
import { MAX_REFERENCES } from "./traces";

interface Props {
  captures: readonly CaptureLine[];
  open: string | undefined;
  references: readonly string[];
  onOpen: (id: string) => void;
  onReferences: (ids: readonly string[]) => void;
}

/** All captures that are kept; each can be opened, and some laid over it. */
export function CapturesPanel({ captures, open, references, onOpen, onReferences }: Props) {
  const t = useTexts();
  const [typed, setTyped] = useState("");
  if (captures.length === 0) return <p className={classes.told}>{t("page.scope.captures_none")}</p>;
  const words = typed.toLowerCase();
  const shown = captures.filter((one) =>
    `${one.name} ${one.note} ${one.person} ${one.turbine_name}`.toLowerCase().includes(words),
  );
  return (
    <div className={classes.panel}>
      <TextInput
        aria-label={t("page.scope.captures_find")}
        placeholder={t("page.scope.captures_find")}
        leftSection={<IconFilter size={17} aria-hidden />}
        value={typed}
        onChange={(event) => setTyped(event.currentTarget.value)}
      />
      <ul className={classes.captures} data-testid="captures">
        {shown.map((one) => (
          <li key={one.id} data-open={one.id === open}>
            <Button
              variant={one.id === open ? "light" : "subtle"}
              justify="flex-start"
              h="auto"
              mih={44}
              py={4}
              fullWidth
              aria-current={one.id === open}
              onClick={() => onOpen(one.id)}
              data-testid="open-capture"
            >
              <span className={classes.captureText}>
                <span>{one.name}</span>
                <small>
                  {[
                    one.turbine_name,
                    dayAndTime(one.trigger_ns / 1e6),
                    t(`page.scope.cause_${one.cause}`),
                    ...(one.kept ? [] : [t("page.scope.not_kept")]),
                  ].join(" · ")}
                </small>
              </span>
            </Button>
            <Checkbox
              label={t("page.scope.reference_short")}
              aria-label={t("page.scope.reference", { name: one.name })}
              checked={references.includes(one.id)}
              disabled={
                one.id === open || (!references.includes(one.id) && references.length >= MAX_REFERENCES)
              }
              onChange={(event) =>
                onReferences(
                  event.currentTarget.checked
                    ? [...references, one.id]
                    : references.filter((id) => id !== one.id),
                )
              }
              data-testid="reference"
            />
          </li>
        ))}
      </ul>
    </div>
  );
}
