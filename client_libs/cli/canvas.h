// What pictures of maps are drawn with: colours, a plan of the plane, a surface, a legend.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_CANVAS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_CANVAS_H_

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"

namespace hypermap::cli {

// Pixels around the plan, between the lines of a text, and under the plan for the scale bar.
inline constexpr double kMargin = 20.0;
inline constexpr double kLineHeight = 21.0;
inline constexpr double kFooter = 30.0;

// Channels in [0, 1].
struct Colour {
  double red = 0.0;
  double green = 0.0;
  double blue = 0.0;
};
inline constexpr Colour kBlack{0.1, 0.1, 0.1};

constexpr Colour Grey(double level) { return {level, level, level}; }
// `share` of `a` and the rest of `b`.
Colour Mix(const Colour& a, const Colour& b, double share);

// The colour of a class: the same for a label in each picture, however it is spelt.
Colour ColourOfLabel(absl::string_view label);

// A box of the plane in pixels, its upper left corner one margin off that of the picture; y points
// upwards.
class Plan {
 public:
  // `box` must have an area.
  Plan(const Box& box, double pixels_per_m);
  // The scale at which the longer side of `box` has so many pixels.
  static double ScaleToFit(const Box& box, double longer_side);

  double width() const { return width_; }
  double height() const { return height_; }
  double pixels_per_m() const { return pixels_per_m_; }
  Point At(const Point& p) const {
    return {kMargin + (p.x - box_.min.x) * pixels_per_m_,
            kMargin + (box_.max.y - p.y) * pixels_per_m_};
  }

 private:
  Box box_;
  double pixels_per_m_;
  double width_;
  double height_;
};

// How a canvas is laid over another one.
enum class Blend {
  kOver,      // hides the lower canvas
  kMultiply,  // darkens the lower canvas
  kMask,      // keeps the lower canvas only where the upper one is opaque
};

// Draws on a surface that it owns, at places in pixels. Errors are returned by Png. One thread.
class Canvas {
 public:
  // White.
  Canvas(double width, double height);
  ~Canvas();
  // As large, with nothing on it.
  static Canvas Layer(const Canvas& below);

  int width() const;
  int height() const;

  void Fill(const Polygon& polygon, const Plan& plan, const Colour& c, double opacity);
  void Outline(const Polygon& polygon, const Plan& plan, const Colour& c, double width,
               bool broken);
  void Line(const Point& from, const Point& to, const Colour& c, double width, bool broken);
  // Through places of the plan.
  void Path(const std::vector<Point>& points, const Plan& plan, const Colour& c, double width);
  void Cross(const Point& at, double size, const Colour& c, double width = 1.5);
  void Disc(const Point& at, double radius, const Colour& c);
  // A square with its lower left corner at `at`.
  void Square(const Point& at, double size, const Colour& c);
  // `at` is the left end of the base line.
  void Text(const Point& at, const std::string& text);
  double TextWidth(const std::string& text) const;
  // Fills the polygon with these corners and adds it to what is there. So parts of a pixel sum up,
  // and polygons side by side show no seam. For polygons that do not overlap.
  void Add(const Ring& corners, const Plan& plan, const Colour& c, double opacity = 1.0);
  void Lay(const Canvas& upper, Blend blend);

  // Until Unclip, only the plan is drawn on.
  void ClipTo(const Plan& plan);
  void Unclip();

  // The bytes of a PNG.
  absl::StatusOr<std::string> Png() const;

 private:
  struct Drawing;
  explicit Canvas(std::unique_ptr<Drawing> drawing);

  void Trace(const Ring& ring, const Plan& plan);
  void Trace(const Polygon& polygon, const Plan& plan);
  void Stroke(const Colour& c, double width, bool broken);

  const std::unique_ptr<Drawing> drawing_;
};

// The objects in the order in which they are drawn: the largest first, so that a thing on a table
// is seen. `size_of(object)` is what they are compared by.
template <typename Object, typename SizeOf>
std::vector<const Object*> LargestFirst(const std::vector<Object>& objects, SizeOf size_of) {
  std::vector<const Object*> sorted;
  for (const Object& object : objects) sorted.push_back(&object);
  std::stable_sort(sorted.begin(), sorted.end(), [&size_of](const Object* a, const Object* b) {
    return size_of(*a) > size_of(*b);
  });
  return sorted;
}

// A line below the plan whose length is a round number of metres.
void DrawScaleBar(Canvas& canvas, const Plan& plan);

// Writes the lines of a legend from the top down. The canvas must outlive it. One thread.
class Legend {
 public:
  // Where the text behind a sample begins, from the left.
  static constexpr double kIndent = 28.0;

  Legend(Canvas& canvas, const Point& top_left)
      : canvas_(canvas), x_(top_left.x), y_(top_left.y + kLineHeight) {}

  void Text(const std::string& text);
  void Square(const Colour& c, const std::string& text);
  void Line(const Colour& c, bool broken, const std::string& text);
  void Cross(const Colour& c, const std::string& text);
  // A sample that `draw` puts with its lower left corner at a place, narrower than kIndent.
  void Sample(const std::function<void(Canvas& canvas, const Point& at)>& draw,
              const std::string& text);
  void Gap() { y_ += kLineHeight / 2; }

 private:
  // Writes the text behind a sample and goes to the next line.
  void TextBehind(const std::string& text);

  Canvas& canvas_;
  double x_;
  double y_;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_CANVAS_H_
