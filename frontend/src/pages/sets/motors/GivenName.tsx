import { useQuery } from "@tanstack/react-query";
import { motorVersionsQuery } from "../../../api/motors";
import { useTexts } from "../../../texts/texts";
import { useDeviceName } from "../../../ui/devices";
import { titleOf } from "./places";

const MOTOR = /^motor:([0-9a-f-]{36})@(\d+):(.+)$/;

export const isMotor = (given: string): boolean => MOTOR.test(given);

/** What a restore is given, in words: a motor with its version and its drive; anything else as it is. */
export function GivenName({ given }: { given: string }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const [, id = "", version = "", device = ""] = MOTOR.exec(given) ?? [];
  const versions = useQuery({ ...motorVersionsQuery(id), enabled: id !== "" }).data;
  if (id === "") return <>{given}</>;
  const motor = versions?.find((one) => String(one.version) === version);
  return (
    <span data-testid="given-motor">
      {t("page.motors.given", { motor: motor ? titleOf(motor) : id, version, device: nameOf(device) })}
    </span>
  );
}
