// SPDX-License-Identifier: BSD-3-Clause
/**
 * Draws a quad over all of the viewport with a fragment shader. Internal to the module.
 */
#pragma once

#include <vtkWeakPointer.h>

#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>

#include <memory>

class vtkOpenGLQuadHelper;
class vtkShaderProgram;

namespace SurfelSplatting
{
/// While it lives, quads write colour and depth as they come from the shader, blended by the
/// functions that are set. Its destructor restores the state.
class QuadState
{
public:
  explicit QuadState(vtkOpenGLState* state);

private:
  vtkOpenGLState::ScopedglEnableDisable Blend, DepthTest, Cull;
  vtkOpenGLState::ScopedglBlendFuncSeparate BlendFunction;
  vtkOpenGLState::ScopedglDepthFunc DepthFunction;
  vtkOpenGLState::ScopedglDepthMask DepthMask;
};

class FullScreenQuad
{
public:
  /// @param fragmentShader GLSL; must outlive this
  explicit FullScreenQuad(const char* fragmentShader);
  ~FullScreenQuad();

  /// Makes the program current, compiled for the window if need be. Null if it does not compile.
  vtkShaderProgram* Use(vtkOpenGLRenderWindow* window);

  /// Draws with the program that is in use.
  void Draw();

  void ReleaseGraphicsResources();

private:
  const char* FragmentShader;
  std::unique_ptr<vtkOpenGLQuadHelper> Quad;
  vtkWeakPointer<vtkOpenGLRenderWindow> Window; // a program belongs to a window's context
};
}
