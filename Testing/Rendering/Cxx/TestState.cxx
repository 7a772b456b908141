// SPDX-License-Identifier: BSD-3-Clause
/**
 * The pass leaves OpenGL as it found it, in truth and in VTK's own account of it.
 */
#include "Rendering/OpenGL/Functions.h"
#include "RenderingTest.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkObjectFactory.h>
#include <vtkOpaquePass.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkPolyData.h>
#include <vtkRenderState.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <map>
#include <string>
#include <vector>

using namespace RenderingTest;

TEST_SUITE_BEGIN("State");

namespace
{
/// What a pass may have changed, by name.
std::map<std::string, std::vector<GLint>> Snapshot()
{
  struct Value
  {
    const char* Name;
    GLenum Which;
    int Count;
  };
  const Value values[] = { { "draw framebuffer", GL_DRAW_FRAMEBUFFER_BINDING, 1 },
    { "read framebuffer", GL_READ_FRAMEBUFFER_BINDING, 1 },
    { "renderbuffer", GL_RENDERBUFFER_BINDING, 1 }, { "pack alignment", GL_PACK_ALIGNMENT, 1 },
    { "unpack alignment", GL_UNPACK_ALIGNMENT, 1 },
    { "unpack row length", GL_UNPACK_ROW_LENGTH, 1 },
    { "pack buffer", GL_PIXEL_PACK_BUFFER_BINDING, 1 },
    { "unpack buffer", GL_PIXEL_UNPACK_BUFFER_BINDING, 1 }, { "viewport", GL_VIEWPORT, 4 },
    { "scissor", GL_SCISSOR_BOX, 4 }, { "scissor test", GL_SCISSOR_TEST, 1 },
    { "blend", GL_BLEND, 1 }, { "blend source", GL_BLEND_SRC_RGB, 1 },
    { "blend destination", GL_BLEND_DST_RGB, 1 }, { "blend source alpha", GL_BLEND_SRC_ALPHA, 1 },
    { "blend destination alpha", GL_BLEND_DST_ALPHA, 1 }, { "depth test", GL_DEPTH_TEST, 1 },
    { "depth function", GL_DEPTH_FUNC, 1 }, { "depth mask", GL_DEPTH_WRITEMASK, 1 },
    { "color mask", GL_COLOR_WRITEMASK, 4 }, { "cull face", GL_CULL_FACE, 1 },
    { "multisample", GL_MULTISAMPLE, 1 }, { "vertex array", GL_VERTEX_ARRAY_BINDING, 1 } };
  std::map<std::string, std::vector<GLint>> result;
  for (const Value& value : values)
  {
    std::vector<GLint> numbers(static_cast<std::size_t>(value.Count), 0);
    glGetIntegerv(value.Which, numbers.data());
    result[value.Name] = numbers;
  }
  return result;
}

/// Looks at the state before and after another pass.
class WatchingPass : public vtkRenderPass
{
public:
  static WatchingPass* New();
  vtkTypeMacro(WatchingPass, vtkRenderPass);

  void Render(const vtkRenderState* state) override
  {
    while (glGetError() != GL_NO_ERROR)
    {
    }
    const auto before = Snapshot();
    this->Watched->Render(state);
    CHECK(glGetError() == GL_NO_ERROR);
    const auto after = Snapshot();
    for (const auto& entry : before)
    {
      CHECK_MESSAGE(after.at(entry.first) == entry.second, entry.first, " changed");
    }
    this->CheckAccount(state);
    ++this->Count;
  }

  vtkSmartPointer<vtkRenderPass> Watched;
  int Count = 0;

private:
  /// VTK skips calls that its account says are not needed: what it believes must be true.
  void CheckAccount(const vtkRenderState* state)
  {
    auto* window = vtkOpenGLRenderWindow::SafeDownCast(state->GetRenderer()->GetRenderWindow());
    vtkOpenGLState* account = window->GetState();
    for (GLenum which : { GL_BLEND, GL_DEPTH_TEST, GL_CULL_FACE, GL_SCISSOR_TEST })
    {
      CHECK(account->GetEnumState(which) == (glIsEnabled(which) == GL_TRUE));
    }
    int blend[4] = { 0, 0, 0, 0 };
    account->GetBlendFuncState(blend);
    GLint source = 0, destination = 0;
    glGetIntegerv(GL_BLEND_SRC_RGB, &source);
    glGetIntegerv(GL_BLEND_DST_RGB, &destination);
    CHECK(blend[0] == source);
    CHECK(blend[1] == destination);
  }
};
vtkStandardNewMacro(WatchingPass);
}

TEST_CASE_FIXTURE(NoMessages, "Is left as it was")
{
  for (int samples : { 0, 4 })
  {
    Scene scene(90, 70, samples);
    scene.Renderer->SetViewport(0.25, 0.25, 1.0, 1.0);
    scene.Renderer->AddActor(SurfelActor(UnitSphere()));
    scene.Renderer->AddActor(
      QuadActor({ -1.4, -1.2, 0.2 }, { 2.8, 0, 0 }, { 0, 1.1, 0.3 }, { 0, 0, 1 }));
    scene.See(FrontCamera(6.0));

    vtkNew<vtkOpaquePass> opaque;
    scene.Pass->SetDelegatePass(opaque);
    vtkNew<WatchingPass> step;
    step->Watched = scene.Pass;
    vtkNew<vtkRenderStepsPass> steps;
    steps->SetOpaquePass(step);
    scene.Renderer->SetPass(steps);
    scene.Render();
    scene.Render();
    CHECK_NEAR(step->Count, 2, 0);

    scene.Pass->SetDelegatePass(nullptr);
    vtkNew<WatchingPass> whole;
    whole->Watched = scene.Pass;
    scene.Renderer->SetPass(whole);
    scene.Render();
    scene.Window->StereoRenderOn();
    scene.Window->SetStereoType(VTK_STEREO_LEFT);
    scene.Render();
    CHECK_NEAR(whole->Count, 2, 0);
  }
}

TEST_CASE_FIXTURE(NoMessages, "Other renderers are not disturbed")
{
  // A mesh in a renderer of its own, after the pass and without it: the same pixels.
  vtkSmartPointer<vtkImageData> pictures[2];
  for (bool withSurfels : { false, true })
  {
    Scene scene(120, 60, 4);
    scene.Renderer->SetViewport(0, 0, 0.5, 1);
    if (withSurfels)
    {
      scene.Renderer->AddActor(SurfelActor(UnitSphere()));
    }
    scene.See(FrontCamera(6.0));
    vtkNew<vtkRenderer> other;
    other->SetViewport(0.5, 0, 1, 1);
    other->SetBackground(0.3, 0.2, 0.1);
    other->AddActor(QuadActor({ -1, -1.2, 0.2 }, { 1.8, 0.3, 0 }, { 0, 1.1, 0.3 }, { 0, 0, 1 }));
    other->SetActiveCamera(FrontCamera(6.0));
    other->ResetCameraClippingRange();
    scene.Window->AddRenderer(other);
    scene.Render();
    pictures[withSurfels] = Crop(scene.Render(), 60, 0, 60, 60);
  }
  CHECK_NEAR(Compare(pictures[0], pictures[1]).Max, 0.0, 0.0);
}

TEST_SUITE_END();
