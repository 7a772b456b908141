# SPDX-License-Identifier: BSD-3-Clause
"""Tables and plots of accuracy.py's results."""

import sys


def _figures(errors):
    if not errors:
        return " | | |"
    flip = "" if errors["flip"] is None else f"{errors['flip']:.4f}"
    return f" {errors['psnr']:.2f} | {errors['max']:.3f} | {flip} |"


def _write_view(result, file):
    file.write(f"\n## {result['scene']}, {result['confusion']:g} px at infinity "
               f"({result['largest']:.0f} at most), {result['size']} x {result['size']}\n\n")
    if "own_reference" in result:
        file.write("Own reference against the truth: "
                   f"{result['own_reference']['psnr']:.2f} dB.\n\n")
    if "points" in result.get("speed_up", {}):
        s = result["speed_up"]
        file.write(f"One picture has the error of {s['points']:.1f} lens points, "
                   f"{s['at_equal_error']:.1f} times as fast; "
                   f"{s['over_200_points']:.0f} times as fast as 200 points.\n\n")
    file.write("| way | ms | own: dB | max | FLIP | truth: dB | max | FLIP |\n" + "|---" * 8 + "|\n")
    for row in result["rows"] + result.get("peers", []):
        file.write(f"| {row['way']} | {row['milliseconds']:.1f} |" + _figures(row.get("own"))
                   + _figures(row.get("truth")) + "\n")


def _write_summary(results, file):
    file.write("| scene | blur, px | default, ms | own, dB | K = 7, dB | truth, dB | K = 7, dB "
               "| equal error: N | speed-up | over N = 200 |\n" + "|---" * 10 + "|\n")
    for result in results:
        if not result["confusion"]:
            continue
        default = result["rows"][0]
        seven = next(r for r in result["rows"] if r["cells"] == 7 and not r["pinholes"])
        s = result["speed_up"]
        truth = [f"{r['truth']['psnr']:.2f}" if "truth" in r else "" for r in (default, seven)]
        equal = ([f"{s['points']:.1f}", f"{s['at_equal_error']:.1f}"] if "points" in s
                 else ["", ""])
        file.write(f"| {result['scene']} | {result['confusion']:g} | {default['milliseconds']:.0f} "
                   f"| {default['own']['psnr']:.2f} | {seven['own']['psnr']:.2f} "
                   f"| {truth[0]} | {truth[1]} | {equal[0]} | {equal[1]} "
                   f"| {s['over_200_points']:.0f} |\n")


def write_tables(results, path):
    with open(path, "w", encoding="utf-8") as file:
        _write_summary(results, file)
        for result in results:
            _write_view(result, file)


def _plot(pyplot, scene, results, path):
    yardsticks = [y for y in ("own", "truth") if y in results[0]["rows"][0]]
    figure, axes = pyplot.subplots(len(yardsticks), len(results), squeeze=False,
                                   figsize=(4.6 * len(results), 3.8 * len(yardsticks)))
    for column, result in enumerate(results):
        for line, yardstick in enumerate(yardsticks):
            axis = axes[line][column]
            points = [r for r in result["rows"] if r["pinholes"]]
            axis.plot([r["milliseconds"] for r in points], [r[yardstick]["rmse"] for r in points],
                      "k.-", linewidth=0.8, label="multisampling")
            cells = [r for r in result["rows"] if not r["pinholes"] and r["kernel"] == "PearsonII"
                     and r["lod"] == "Moments" and r["lod_error"] == 1.0]
            axis.plot([r["milliseconds"] for r in cells], [r[yardstick]["rmse"] for r in cells],
                      "C0o-", label="lens cells, K = " + ", ".join(str(r["cells"]) for r in cells))
            others = [r for r in result["rows"] if not r["pinholes"] and r not in cells]
            for number, row in enumerate(others):
                axis.plot(row["milliseconds"], row[yardstick]["rmse"], "s", color=f"C{number + 1}",
                          markersize=5, label=row["way"])
            for number, row in enumerate(result.get("peers", [])):
                if yardstick == "truth":
                    axis.plot(row["milliseconds"], row["truth"]["rmse"], "x",
                              color=f"C{number % 10}", label=row["way"])
            axis.set(xscale="log", yscale="log", xlabel="frame, ms", ylabel="RMSE",
                     title=f"{scene}, {result['confusion']:g} px; against {yardstick}")
            axis.grid(alpha=0.3)
    for line in axes:
        line[0].legend(fontsize=6)
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    pyplot.close(figure)


def write_plots(results, out):
    try:
        import matplotlib
    except ImportError:
        print("no plots: install python3-matplotlib", file=sys.stderr)
        return
    matplotlib.use("Agg")
    from matplotlib import pyplot

    for scene in dict.fromkeys(r["scene"] for r in results):
        blurred = [r for r in results if r["scene"] == scene and r["confusion"]]
        if blurred:
            name = scene.replace(",", "").replace(" ", "-")
            _plot(pyplot, scene, blurred, f"{out}-{name}.png")
