import { Alert, Button, Stack, Text } from "@mantine/core";
import {
  IconAlertTriangle,
  IconCircleCheck,
  IconCircleX,
  IconInfoCircle,
  IconListCheck,
} from "@tabler/icons-react";
import { useContext } from "react";
import type { RuleFinding, StationFindings } from "../../api/rules";
import { usePageSearch } from "../../frame/search";
import { isBroken } from "../../model/ruleFindings";
import { useTexts } from "../../texts/texts";
import { type Place, stationName } from "../../ui/devices";
import { RuleFindingList } from "./RuleFindingList";
import { JudgedContext } from "./rules";
import { useOpenParameter } from "./useOpenParameter";
import classes from "./Rules.module.css";
import { Dialog } from "../../ui/Dialog";

const WEIGHTS = [
  { severity: "error", Icon: IconCircleX },
  { severity: "warning", Icon: IconAlertTriangle },
  { severity: "note", Icon: IconInfoCircle },
] as const;

/** How many rules are broken, and the way to the list of them. */
export function RuleButton() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const { stations } = useContext(JudgedContext);
  return (
    <Button
      variant="default"
      px="sm"
      leftSection={<IconListCheck size={17} aria-hidden />}
      onClick={() => update({ findings: "open" })}
      data-testid="rules-open"
    >
      {t("page.rules.button")}
      <Counts findings={stations.flatMap((one) => one.findings)} />
    </Button>
  );
}

function Counts({ findings }: { findings: readonly RuleFinding[] }) {
  const t = useTexts();
  const broken = findings.filter(isBroken);
  return (
    <span className={classes.counts}>
      {WEIGHTS.map(({ severity, Icon }) => {
        const count = broken.filter((one) => one.severity === severity).length;
        if (count === 0) return null;
        const label = t(`rule.severity.${severity}`);
        return (
          <span key={severity} data-severity={severity} title={label} data-testid={`rules-${severity}`}>
            <Icon size={15} role="img" aria-label={label} /> {count}
          </span>
        );
      })}
    </span>
  );
}

/** What the rules say of every station of the turbine, with all that is pending. */
export function RuleOverview({ places, onClose }: { places: readonly Place[]; onClose: () => void }) {
  const t = useTexts();
  const jump = useOpenParameter();
  const { stations, error } = useContext(JudgedContext);
  return (
    <Dialog
      opened
      onClose={onClose}
      size={860}
      title={<Text fw={700}>{t("page.rules.title")}</Text>}
      data-testid="rules-dialog"
    >
      <Stack gap="lg">
        <Text size="sm" className="dim">
          {t("page.rules.explain")}
        </Text>
        {error && (
          <Alert color="orange" p="sm">
            {t("page.rules.failed")}
          </Alert>
        )}
        {[...stations].sort(byErrors).map((one) => (
          <Station key={one.station} station={one} places={places} onJump={jump} />
        ))}
      </Stack>
    </Dialog>
  );
}

const errorsOf = (one: StationFindings): number =>
  one.findings.filter((finding) => isBroken(finding) && finding.severity === "error").length;

/** Stations with errors come first, else they stay in their order. */
const byErrors = (a: StationFindings, b: StationFindings): number =>
  Number(errorsOf(b) > 0) - Number(errorsOf(a) > 0);

interface StationProps {
  station: StationFindings;
  places: readonly Place[];
  onJump: (device: string, address: string) => void;
}

function Station({ station, places, onJump }: StationProps) {
  const t = useTexts();
  const place = places.find((one) => station.devices.includes(one.device.slug));
  return (
    <section className={classes.station} data-testid={`rules-${station.station}`}>
      <h3>
        {place ? stationName(place.station, t) : station.station}
        <Counts findings={station.findings} />
      </h3>
      {!station.findings.some(isBroken) && (
        <span className={classes.counts}>
          <IconCircleCheck size={16} aria-hidden /> {t("page.rules.none")}
        </span>
      )}
      <RuleFindingList findings={station.findings} onJump={onJump} />
    </section>
  );
}
