import { IconCircleCheck, IconLock } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { interlocksQuery } from "../../api/motion";
import { type PageSearch, roomSearch } from "../../frame/search";
import motion from "../../motion/Motion.module.css";
import { useTexts } from "../../texts/texts";

/** Proven by a guided check that another room has. */
const ORDER = "pzd_order";

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
            <span>
              {t(`interlock.${name}.${bites ? "bites" : "clear"}`, details)}
              {bites && name === ORDER && (
                <>
                  {" "}
                  <Link
                    to="/bus"
                    search={(before: PageSearch) => roomSearch(before)}
                    data-testid="to-order-check"
                  >
                    {t("page.hydraulic.order_link")}
                  </Link>
                </>
              )}
            </span>
          </li>
        ))}
      </ul>
    </section>
  );
}
