import { Button, Checkbox, TextInput } from "@mantine/core";
import { IconFilter } from "@tabler/icons-react";
import { useState } from "react";
import type { Capture } from "../../../api/scope";
import { useTexts } from "../../../texts/texts";
import { dayAndTime } from "../../../ui/format";
import classes from "./Scope.module.css";
import { MAX_REFERENCES } from "./traces";

interface Props {
  captures: readonly Capture[];
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
  const shown = captures.filter(({ head }) =>
    `${head.name} ${head.note} ${head.person} ${head.turbine_name}`.toLowerCase().includes(words),
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
        {shown.map(({ head, kept }) => (
          <li key={head.id} data-open={head.id === open}>
            <Button
              variant={head.id === open ? "light" : "subtle"}
              justify="flex-start"
              h="auto"
              mih={44}
              py={4}
              fullWidth
              aria-current={head.id === open}
              onClick={() => onOpen(head.id)}
              data-testid="open-capture"
            >
              <span className={classes.captureText}>
                <span>{head.name}</span>
                <small>
                  {[
                    head.turbine_name,
                    dayAndTime(head.trigger_ns / 1e6),
                    t(`page.scope.cause_${head.cause}`),
                    ...(kept ? [] : [t("page.scope.not_kept")]),
                  ].join(" · ")}
                </small>
              </span>
            </Button>
            <Checkbox
              label={t("page.scope.reference_short")}
              aria-label={t("page.scope.reference", { name: head.name })}
              checked={references.includes(head.id)}
              disabled={
                head.id === open || (!references.includes(head.id) && references.length >= MAX_REFERENCES)
              }
              onChange={(event) =>
                onReferences(
                  event.currentTarget.checked
                    ? [...references, head.id]
                    : references.filter((one) => one !== head.id),
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
