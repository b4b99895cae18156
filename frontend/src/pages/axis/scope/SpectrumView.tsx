import { Select } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import type UPlot from "uplot";
import { type CaptureHead, type Spectrum, spectrumQuery } from "../../../api/scope";
import { usePageSearch } from "../../../frame/search";
import { localise } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { Chart } from "./Chart";
import classes from "./Scope.module.css";
import type { Trace } from "./traces";
import { type Pair, stretchOf } from "./view";

interface Props {
  head: CaptureHead;
  traces: readonly Trace[];
  view: Pair;
  cursors: Pair | null;
  drawn: Map<string, UPlot>;
}

/** What vibrates in one signal. */
export function SpectrumView({ head, traces, view, cursors, drawn }: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const chosen =
    traces.find((one) => one.name === search.spectrum) ?? traces.find((one) => !one.bit) ?? traces[0];
  const { data, error } = useQuery(spectrumQuery(head.id, chosen?.name ?? "", stretchOf(cursors, view)));
  if (!chosen) return null;
  return (
    <section className={classes.analysis}>
      <div className={classes.choices}>
        <Select
          label={t("page.scope.fft_signal")}
          data={traces.map((one) => ({ value: one.name, label: one.label }))}
          value={chosen.name}
          onChange={(name) => update({ spectrum: name ?? undefined })}
          allowDeselect={false}
          w={420}
          data-testid="fft-signal"
        />
        <span className="dim">{t(cursors ? "page.scope.fft_between" : "page.scope.fft_view")}</span>
      </div>
      {error && <ProblemAlert error={error} title={t("page.scope.view_failed")} />}
      {data && (
        <>
          <Chart
            x={data.frequency_hz}
            y={data.amplitude}
            colour={chosen.colour}
            label={t("page.scope.fft_plot", { signal: chosen.label })}
            xUnit={t("page.scope.fft_axis")}
            yUnit={data.unit}
            fromZero
            drawn={drawn}
            name="fft"
          />
          <Told spectrum={data} />
          <Peaks spectrum={data} />
        </>
      )}
    </section>
  );
}

function Told({ spectrum }: { spectrum: Spectrum }) {
  const t = useTexts();
  const number = (value: number, digits: number) =>
    localise(value.toFixed(digits).replace("-", "−"), t.language);
  const told = {
    values: spectrum.values,
    from: number(spectrum.from_s, 3),
    to: number(spectrum.to_s, 3),
    rate: number(spectrum.rate_hz, 1),
    uneven: number(100 * spectrum.unevenness, 0),
    mean: `${number(spectrum.mean, 3)} ${spectrum.unit}`.trim(),
  };
  return (
    <p className={classes.told} data-testid="fft-told">
      {t("page.scope.fft_told", told)}
    </p>
  );
}

function Peaks({ spectrum }: { spectrum: Spectrum }) {
  const t = useTexts();
  const number = (value: number) => localise(value.toPrecision(4).replace("-", "−"), t.language);
  if (spectrum.peaks.length === 0) return <p className={classes.told}>{t("page.scope.peaks_none")}</p>;
  return (
    <table className={`${classes.values} ${classes.peaks} bench`} data-testid="peaks">
      <caption>{t("page.scope.peaks")}</caption>
      <thead>
        <tr>
          <th scope="col" className={classes.number}>
            {t("page.scope.peak_frequency")}
          </th>
          <th scope="col" className={classes.number}>
            {`${t("page.scope.peak_amplitude")}${spectrum.unit === "" ? "" : `, ${spectrum.unit}`}`}
          </th>
        </tr>
      </thead>
      <tbody>
        {spectrum.peaks.map((peak) => (
          <tr key={peak.frequency_hz}>
            <td className={classes.number}>{number(peak.frequency_hz)}</td>
            <td className={classes.number}>{number(peak.amplitude)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
