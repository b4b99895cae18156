import { NumberInput, Select, TagsInput } from "@mantine/core";
import { useState } from "react";
import { useTexts } from "../../../texts/texts";
import { type Curve, curvesText, MAX_CURVES, parseCurve, type Span } from "./choice";
import classes from "./Overlay.module.css";

/** What is looked at most around a trip; any other address can be typed. */
const USUAL = ["6064", "607A", "60F4", "606C", "6078", "6079", "6041", "3060", "3063", "3070"];
const BLADES = [1, 2, 3];
const ALL = "all";
const MOST_S = 3600;

interface Props {
  curves: readonly Curve[];
  span: Span;
  onCurves: (curves: readonly Curve[]) => void;
  onSpan: (span: Span) => void;
}

/** Which objects of which blade, and how long before and after the zero. */
export function CurveTools({ curves, span, onCurves, onSpan }: Props) {
  const t = useTexts();
  const [wrong, setWrong] = useState<string | null>(null);
  const blades = new Set(curves.map(({ blade }) => blade));
  const blade = blades.size === 1 ? ([...blades][0] ?? null) : null;
  const take = (texts: string[]) => {
    const read = texts.map((text) => ({ text, curve: parseCurve(text.split(" ")[0] ?? "") }));
    setWrong(read.find(({ curve }) => curve === null)?.text ?? null);
    onCurves(read.flatMap(({ curve }) => (curve ? [{ ...curve, blade: curve.blade ?? blade }] : [])));
  };
  const seconds = (name: "beforeS" | "afterS", least: number) => (
    <NumberInput
      label={t(`page.overlay.${name === "beforeS" ? "before" : "after"}`)}
      value={span[name]}
      onChange={(typed) =>
        typeof typed === "number" && typed >= least && typed <= MOST_S && onSpan({ ...span, [name]: typed })
      }
      min={least}
      max={MOST_S}
      decimalScale={3}
      decimalSeparator={t.language === "de" ? "," : "."}
      hideControls
      w={92}
      data-testid={`overlay-${name}`}
    />
  );
  return (
    <div className={classes.tools}>
      <TagsInput
        className={classes.wide ?? ""}
        label={t("page.overlay.signals")}
        value={curves.map((one) => curvesText([{ ...one, blade: null }]))}
        onChange={take}
        data={USUAL.map((value) => ({ value, label: `${value} ${t(`page.overlay.usual.${value}`)}` }))}
        error={wrong === null ? undefined : t("page.overlay.no_address", { text: wrong })}
        maxTags={MAX_CURVES}
        acceptValueOnBlur
        data-testid="overlay-curves"
      />
      <Select
        label={t("page.overlay.blade")}
        value={blade === null ? ALL : String(blade)}
        onChange={(value) => {
          const chosen = value === null || value === ALL ? null : Number(value);
          onCurves(curves.map(({ address }) => ({ address, blade: chosen })));
        }}
        data={[
          { value: ALL, label: t("page.overlay.all_blades") },
          ...BLADES.map((one) => ({ value: String(one), label: t("page.blade", { blade: one }) })),
        ]}
        allowDeselect={false}
        w={130}
        data-testid="overlay-blade"
      />
      {seconds("beforeS", 0)}
      {seconds("afterS", 0.1)}
    </div>
  );
}
