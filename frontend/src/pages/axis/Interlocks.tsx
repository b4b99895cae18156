import { IconCircleCheck, IconLock } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { interlocksQuery } from "../../api/motion";
import motion from "../../motion/Motion.module.css";
import { useTexts } from "../../texts/texts";

/** What holds the axis back, each with its reason, before it bites. */
export function Interlocks({ device, title }: { device: string; title: string }) {
  const t = useTexts();
  const { data } = useQuery(interlocksQuery(device));
  return (
    <section aria-label={title}>
      <h3>{title}</h3>
      <ul className={motion.locks} data-testid="interlocks">
        {(data ?? []).map(({ name, holds_back: bites, details }) => (
          <li key={name} data-bites={bites} data-testid={`interlock-${name}`}>
            {bites ? <IconLock size={17} aria-hidden /> : <IconCircleCheck size={17} aria-hidden />}
            <span>{t(`interlock.${name}.${bites ? "bites" : "clear"}`, details)}</span>
          </li>
        ))}
      </ul>
    </section>
  );
}
