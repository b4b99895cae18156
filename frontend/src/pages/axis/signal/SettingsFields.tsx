import { NumberInput } from "@mantine/core";
import type { SignalSettings } from "../../../api/signals";
import motion from "../../../motion/Motion.module.css";
import { useTexts } from "../../../texts/texts";
import { typedNumber } from "../../../ui/typedNumber";

type Field = "amplitude_deg" | "frequency_hz" | "cycles" | "speed_dps" | "hold_s";

interface Look {
  suffix: string;
  step: number;
  decimals: number;
  min?: number;
  max: number;
}

const LOOKS: Readonly<Record<Field, Look>> = {
  amplitude_deg: { suffix: "°", step: 0.1, decimals: 2, max: 10 },
  frequency_hz: { suffix: " Hz", step: 0.1, decimals: 2, min: 0.05, max: 2 },
  cycles: { suffix: "", step: 1, decimals: 0, min: 1, max: 20 },
  speed_dps: { suffix: " °/s", step: 0.5, decimals: 1, min: 0.1, max: 5 },
  hold_s: { suffix: " s", step: 0.5, decimals: 1, min: 0.2, max: 10 },
};

const FIELDS: Readonly<Record<SignalSettings["shape"], readonly Field[]>> = {
  sine: ["amplitude_deg", "frequency_hz", "cycles"],
  step: ["amplitude_deg", "speed_dps", "hold_s"],
  ramp: ["amplitude_deg", "speed_dps", "hold_s", "cycles"],
};

interface Props {
  settings: SignalSettings;
  onChange: (settings: SignalSettings) => void;
}

/** What a signal of its shape is described by. */
export function SettingsFields({ settings, onChange }: Props) {
  const t = useTexts();
  return (
    <div className={motion.row}>
      {FIELDS[settings.shape].map((field) => {
        const look = LOOKS[field];
        return (
          <NumberInput
            key={`${settings.shape}${field}`}
            label={t(`page.signal.field.${field}`)}
            value={settings[field]}
            onChange={(value) => typedNumber(value, (number) => onChange({ ...settings, [field]: number }))}
            min={look.min ?? -look.max}
            max={look.max}
            step={look.step}
            decimalScale={look.decimals}
            suffix={look.suffix}
            w={128}
            data-testid={`signal-${field}`}
          />
        );
      })}
    </div>
  );
}
