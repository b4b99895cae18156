import { ActionIcon, Menu, TextInput } from "@mantine/core";
import { IconBook2 } from "@tabler/icons-react";
import { Problem } from "../../../api/client";
import type { Signature } from "../../../api/search";
import { useTexts } from "../../../texts/texts";
import { storyOf } from "../../../ui/problem";
import classes from "./Search.module.css";

/** What people look for most; the words are those of the search language, in every language of the page. */
const EXAMPLES = [
  ["following", "60F4 > 0.8 deg within 5 s before emcy 8611"],
  ["mains", "mains_low then emcy within 20 s"],
  ["silent", "silent then chain_open within 2 s"],
  ["lasting", "|60F4| > 0.5 for 200 ms"],
  ["no_trip", "chain_open without trip within 1 s"],
  ["trips", "trip"],
] as const;

interface Props {
  text: string;
  onText: (text: string) => void;
  understood: Signature | undefined;
  error: Error | null;
}

/** The line of a signature: how it is understood below it, or the character at which it is not. */
export function SignatureInput({ text, onText, understood, error }: Props) {
  const t = useTexts();
  const wrong = text.trim() !== "" && error !== null;
  return (
    <div className={classes.input}>
      <TextInput
        label={t("page.search.label")}
        value={text}
        onChange={(event) => onText(event.currentTarget.value)}
        placeholder={EXAMPLES[0][1]}
        spellCheck={false}
        error={wrong ? storyOf(error, t).happened : undefined}
        description={<Understood text={text} understood={understood} error={wrong ? error : null} />}
        inputWrapperOrder={["label", "input", "description", "error"]}
        classNames={{ input: classes.line ?? "" }}
        rightSection={<Examples onText={onText} />}
        rightSectionWidth={44}
        data-testid="signature"
      />
    </div>
  );
}

function Understood({ text, understood, error }: { text: string } & Pick<Props, "understood" | "error">) {
  const t = useTexts();
  const at = positionOf(error);
  if (at !== null)
    return (
      <span className={classes.marked} aria-hidden>
        {text.slice(0, at - 1)}
        <mark>{text.slice(at - 1) || "␣"}</mark>
      </span>
    );
  if (understood && understood.text !== text.trim())
    return <>{t("page.search.understood", { text: understood.text })}</>;
  return <>{t("page.search.hint")}</>;
}

function positionOf(error: Error | null): number | null {
  const position = error instanceof Problem ? error.doc.details.position : null;
  return typeof position === "number" ? position : null;
}

function Examples({ onText }: Pick<Props, "onText">) {
  const t = useTexts();
  return (
    <Menu position="bottom-end" withinPortal>
      <Menu.Target>
        <ActionIcon
          variant="subtle"
          size={36}
          aria-label={t("page.search.examples")}
          title={t("page.search.examples")}
        >
          <IconBook2 size={19} aria-hidden />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        {EXAMPLES.map(([name, example]) => (
          <Menu.Item key={name} onClick={() => onText(example)}>
            <span className={classes.example}>
              <strong>{t(`page.search.example.${name}`)}</strong>
              <code>{example}</code>
            </span>
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}
