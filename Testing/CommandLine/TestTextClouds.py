# SPDX-License-Identifier: BSD-3-Clause
"""Text clouds: columns, delimiters and headers."""

import re
import unittest

import numpy as np

from surfelsplatting.formats.ptx import read_ptx_cloud
from surfelsplatting.formats.text import read_text_cloud
from surfelsplatting.problems import UserProblem
from toolcase import SMALL, ToolCase, arrays_of, content_of, places_of, sphere, write


class TestTextClouds(ToolCase):
    def read(self, text, path="cloud.xyz"):
        write(path, text)
        cloud, self.columns = read_text_cloud(path)
        return places_of(cloud), arrays_of(cloud)

    def check_points(self, text, expected=((1, 2, 3), (4, 5, 6)), path="cloud.xyz"):
        points, arrays = self.read(text, path)
        np.testing.assert_array_equal(points, expected)
        return arrays

    def test_delimiters_comments_and_headers(self):
        for text in ("1 2 3\n4 5 6\n", "1,2,3\n4,5,6\n", "1, 2, 3\n4, 5, 6", "1;2;3\n4;5;6\n",
                     "  1\t2  3\n\n4 5 6\n", "# made by hand\n1 2 3 # first\n4 5 6\n",
                     "//X Y Z\n1 2 3\n4 5 6\n", "2\n1 2 3\n4 5 6\n", "# n\n2\n\n1 2 3\n4 5 6\n",
                     "x,y,z\n1,2,3\n4,5,6\n", "1 2 3\r\n4 5 6\r\n", "x|y|z\n1|2|3\n4|5|6\n", "1 | 2 | 3\n4 | 5 | 6"):
            self.assertEqual(self.check_points(text), {}, repr(text))

    def test_points_that_begin_with_their_names(self):
        for text in ("point,x,y,z\nP1,1,2,3\nP2,4,5,6\n", "name;x;y;z\nP 1;1,0;2,0;3,0\nP 2;4;5;6\n",
                     "#Label,X/Easting,Y/Northing,Z/Altitude\nP1,1,2,3\nP2,4,5,6\n",
                     "id\tcode\teast\tnorth\theight\nA1\tgr\t1\t2\t3\nA2\tgr\t4\t5\t6\n"):
            self.assertEqual(self.check_points(text, path="a.csv"), {}, text)
        self.check_points("x,y,z\nm,m,m\n1,2,3\n4,5,6\n")
        arrays = self.check_points("X,Y,Z,R,G,B\nm,m,m,-,-,-\n1,2,3,10,20,30\n4,5,6,40,50,60\n", path="a.csv")
        np.testing.assert_array_equal(arrays["RGB"], [[10, 20, 30], [40, 50, 60]])
        self.assertFalse(self.columns.unsure)

    def test_tables_that_were_joined(self):
        for head in ("x,y,z,r,g,b\n", "made by me\nx,y,z,r,g,b\nm,m,m,-,-,-\n"):
            text = head + "1,2,3,,20,30\n\ufeff" + head + "4,5,6,40,50,60\n"
            arrays = self.check_points(text, path="a.csv")
            np.testing.assert_array_equal(arrays["RGB"], [[0, 20, 30], [40, 50, 60]])

    def test_comments_of_other_programs(self):
        for mark in ("%", "! ", "//", "# "):
            arrays = self.check_points(f"{mark}a file of three words\n{mark}x y z intensity\n1 2 3 7\n4 5 6 8\n")
            np.testing.assert_array_equal(arrays["intensity"], [7, 8], mark)
            self.assertFalse(self.columns.unsure)
        self.check_points("! made by me\n1 2 3\n4 5 6\n")
        self.assertFalse(self.columns.unsure)

    def test_columns_of_words(self):
        """Are left out, with names and without"""
        for text in ("1,2,3,GRD\n4,5,6,\n", "1 2 3 tree\n4 5 6 house\n", ",1,2,3,a\n,4,5,6,b\n",
                     "1;2;3;tree, old;\n4;5;6;a;\n"):
            self.assertEqual(self.check_points(text, path="a.csv"), {}, text)
        with self.assertRaisesRegex(UserProblem, "begins with 'P1,1,2,3'; where words come before x y z, name all"):
            self.read("P1,1,2,3\nP2,4,5,6\n", "a.csv")

    def test_words_in_quotes(self):
        """What separates columns may be in them."""
        for text in ('name,x,y,z\n"house",1,2,3\n"tree, big",4,5,6\n',
                     'x;y;z;"kind"\n1;2;3;"a;b tree"\n4;5;6;"tree"\n'):
            self.assertEqual(self.check_points(text, path="a.csv"), {}, text)

    def test_cells_between_tabs(self):
        """May be empty, or hold words with blanks."""
        for text in ("x\ty\tz\tt\n1\t2\t3\t\n4\t5\t6\t7\n",
                     "x\tkind\ty\tz\tt\n1\t\t2\t3\t\n4\ta tree\t5\t6\t7\n"):
            arrays = self.check_points(text, path="a.txt")
            np.testing.assert_array_equal(arrays["t"], [np.nan, 7], text)
        self.check_points("1\t2\t3\ta house\n4\t5\t6\ttree\n")
        self.check_points("1\t 2\t3\n4 5\t6\n")

    def test_number_of_points_and_columns(self):
        """In the first line, which is no point"""
        arrays = self.check_points("2 6\n1 2 3 10 20 30\n4 5 6 40 50 60\n")
        np.testing.assert_array_equal(arrays["RGB"], [[10, 20, 30], [40, 50, 60]])

    def test_colors_in_hexadecimal(self):
        expected = [[255, 128, 1], [0, 2, 0]]
        for text in ("x,y,z,color\n1,2,3,#ff8001\n4,5,6,#000200\n",
                     "1 2 3 #FF8001\n4 5 6 #000200 # the last\n",
                     'x;y;colour;"z"\n1,0;2;"#ff8001";3\n4;5;"#000200";6,0\n',
                     "1\t2\t3\t0xff8001\n4\t5\t6\t0x000200\n",
                     "name,x,y,z,color\na,1,2,3,#ff8001\nb,4,5,6,#000200\n",
                     "x,y,z,c,w\n1,2,3,#ff8001,a\n4,5,6,#000200,?\n"):
            arrays = self.check_points(text, path="a.csv")
            self.assertEqual(set(arrays), {"RGB"}, text)
            np.testing.assert_array_equal(arrays["RGB"], expected, text)
        arrays = self.check_points("x,y,z,color,t\n1,2,3,,7\n4,5,6,#ff8001,8\n", path="a.csv")
        np.testing.assert_array_equal(arrays["RGB"], [[0, 0, 0], [255, 128, 1]])
        np.testing.assert_array_equal(arrays["t"], [7, 8])
        for text in ("1 2 3 9 #ff8001\n4 5 6 2000 #000200\n", "#ff8001,1,2,3,9\n#000200,4,5,6,2000\n"):
            arrays = self.check_points(text)
            np.testing.assert_array_equal(arrays["intensity"], [9, 2000])
            np.testing.assert_array_equal(arrays["RGB"], expected)
        for text in ("#facade\n1 2 3\n4 5 6\n", "x y z kind\n1 2 3 red\n4 5 6 #ff8001\n"):  # no colours
            self.assertEqual(self.check_points(text), {}, text)

    def test_numbers_of_other_languages(self):
        """Exponents of Fortran, the minus of .NET in the North of Europe, and Windows' NaN"""
        for text in ("1.0D+00 0.2D1 3.d0\n4 5 6\n", "x,y,z,t\n1.D0,2,3,-7.5d-01\n4,5,6,1.25D+003\n"):
            arrays = self.check_points(text)
        np.testing.assert_array_equal(arrays["t"], [-0.75, 1250])
        self.check_points("\u22121 2 \u2212.5\n4 5 6\n", ((-1, 2, -0.5), (4, 5, 6)))
        for word in ("-nan(ind)", "nan(snan)", "1.#QNAN", "-1.#IND", "1.#INF00"):
            nan = np.full(3, np.nan)
            self.check_points(f"{word} {word} {word}\n4 5 6\n", (nan, (4, 5, 6)))
            self.assertFalse(self.columns.unsure)
            points, _ = self.read(2000 * "1 2 3\n" + f"{word} {word} {word}\n")  # behind the first lines
            np.testing.assert_array_equal(points[[-2, -1]], ((1, 2, 3), nan))

    def test_marks_in_pts_files(self):
        for text in ("2\n1 2 3\n4 5 6\n", "BEGIN\n1 2 3\n4 5 6\nEND\n", "1\n1 2 3\n1\n4 5 6\n"):
            self.check_points(text, path="cloud.pts")

    def test_degrees_become_metres(self):
        """A minute of latitude is a sea mile, about 1852 m, and one of longitude at the equator; at 60
        degrees half of it."""
        for header in ("lon,lat,alt", "Longitude, Latitude, Height", "latitude,longitude,elevation",
                       "# lon,lat,alt", "//Longitude,Latitude,Height"):
            for latitude, wide, long in ((0, 1855.3, 1842.9), (60, 930.0, 1856.9)):
                rows = np.array([[11, latitude, 500], [11 + 1 / 60, latitude, 510],
                                 [11, latitude + 1 / 60, 520]])
                if header.startswith("lat"):
                    rows = rows[:, [1, 0, 2]]
                text = "\n".join(",".join(f"{x:.12f}" for x in row) for row in rows)
                points, _ = self.read(f"{header}\n{text}\n", "a.csv")
                self.assertTrue(self.columns.are_degrees)
                steps = points[1:] - points[0]
                np.testing.assert_allclose(steps, [[wide, 0, 10], [0, long, 20]], rtol=3e-4, atol=1e-3)
        points, _ = self.read("x,y,z,lat,lon\n1,2,3,4,5\n4,5,6,7,8\n", "a.csv")
        np.testing.assert_array_equal(points, [[1, 2, 3], [4, 5, 6]])
        points, _ = self.read("lon,lat,alt\n0,0,0\nnan,inf,0\n0,0.01,0\n", "a.csv")
        np.testing.assert_allclose(points[[0, 2], 1], [-552.9, 552.9], atol=0.1)
        self.read("lon,lat,alt\nnan,nan,0\nnan,0,0\n", "a.csv")
        self.assertIn("degrees as metres", self.info(write("b.csv", f"{header}\n{text}\n")))

    def test_utm_coordinates_keep_their_detail(self):
        points, _ = self.read("691000.00015 5334000.12345 512.5\n691000.0003 5334000.1235 512\n")
        np.testing.assert_array_equal(points, [[691000.00015, 5334000.12345, 512.5],
                                               [691000.0003, 5334000.1235, 512]])

    def test_intensity(self):
        arrays = self.check_points("1 2 3 0.5\n4 5 6 17\n")
        np.testing.assert_array_equal(arrays["intensity"], [0.5, 17])

    def test_colors(self):
        arrays = self.check_points("1 2 3 255 128 0\n4 5 6 0 0 1\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 128, 0], [0, 0, 1]])
        arrays = self.check_points("1 2 3 1.0 0.5 0\n4 5 6 0.2 0 0\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 128, 0], [51, 0, 0]])

    def test_whole_colors_within_one_are_fractions(self):
        arrays = self.check_points("1 2 3 1 1 1\n4 5 6 0 0 1\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 255, 255], [0, 0, 255]])

    def test_normals(self):
        arrays = self.check_points("1 2 3 0 0 -1\n4 5 6 0.6 0.8 0\n")
        np.testing.assert_allclose(arrays["Normals"], [[0, 0, -1], [0.6, 0.8, 0]], rtol=1e-6)
        # Whole numbers, but of length 1: a floor, not nearly black colours.
        arrays = self.check_points("1 2 3 0 0 1\n4 5 6 0 0 1\n")
        np.testing.assert_array_equal(arrays["Normals"], [[0, 0, 1], [0, 0, 1]])

    def test_seven_and_nine_columns(self):
        arrays = self.check_points("1 2 3 900 10 20 30\n4 5 6 -5 40 50 60\n")
        np.testing.assert_array_equal(arrays["intensity"], [900, -5])
        np.testing.assert_array_equal(arrays["RGB"], [[10, 20, 30], [40, 50, 60]])
        arrays = self.check_points("1 2 3 10 20 30 900\n4 5 6 40 50 60 -5\n")
        np.testing.assert_array_equal(arrays["intensity"], [900, -5])
        for row in ("0.25 10 200 30", "10 200 30 0.25"):  # colours of which no two channels are alike
            arrays = self.check_points(f"1 2 3 {row}\n4 5 6 {row.replace('0.25', '0.5')}\n")
            np.testing.assert_array_equal(arrays["intensity"], [0.25, 0.5])
            np.testing.assert_array_equal(arrays["RGB"], [[10, 200, 30]] * 2)
            self.assertFalse(self.columns.unsure)
        for order in ("{n} {c}", "{c} {n}"):
            row = order.format(n="0 0 -1", c="9 8 7")
            arrays = self.check_points(f"1 2 3 {row}\n4 5 6 {row}\n")
            np.testing.assert_array_equal(arrays["RGB"], [[9, 8, 7]] * 2)
            np.testing.assert_array_equal(arrays["Normals"], [[0, 0, -1]] * 2)

    def test_missing_values(self):
        points, _ = self.read("nan nan nan 0 0 0\n4 5 6 10 20 30\n")
        np.testing.assert_array_equal(np.isnan(points[:, 0]), [True, False])

    def test_sixteen_bit_colors(self):
        arrays = self.check_points("1 2 3 65535 32896 0\n4 5 6 0 0 257\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 128, 0], [0, 0, 1]])

    def test_integer_intensity_is_no_color(self):
        for path, rows, unsure in (
                ("cloud.pts", "2\n1 2 3 200 10 20 30\n4 5 6 9 40 50 60\n", False),
                ("cloud.pts", "1\n1 2 3 -2048 10 20 30\n1\n4 5 6 9 40 50 60\n", False),
                ("cloud.xyz", "1 2 3 200 10 20 30\n4 5 6 9 40 50 60\n", True),
                ("cloud.asc", "1 2 3 2000 10 20 30\n4 5 6 9 40 50 60\n", False),
                ("cloud.xyz", "//X Y Z I R G B\n1 2 3 9 10 20 30\n4 5 6 9 40 50 60\n", False)):
            arrays = self.check_points(rows, path=path)
            np.testing.assert_array_equal(arrays["RGB"], [[10, 20, 30], [40, 50, 60]], rows)
            self.assertEqual(self.columns.unsure, unsure, rows)
            self.assertIn("x, y, z, intensity, red, green, blue", str(self.columns))
        arrays = self.check_points("1 2 3 10 20 30 200\n4 5 6 40 50 60 9\n")
        np.testing.assert_array_equal(arrays["intensity"], [200, 9])
        self.assertTrue(self.columns.unsure)
        arrays = self.check_points("1 2 3 7 0 0 1\n4 5 6 9 0 1 0\n")
        np.testing.assert_array_equal(arrays["Normals"], [[0, 0, 1], [0, 1, 0]])

    def test_names_of_columns(self):
        arrays = self.check_points("id,Y,X,Z [m],\"Scalar field\",b,g,r\n7,2,1,3,0.5,30,20,10\n"
                                   "8,5,4,6,0.25,60,50,40\n", path="cloud.csv")
        np.testing.assert_array_equal(arrays["RGB"], [[10, 20, 30], [40, 50, 60]])
        np.testing.assert_array_equal(arrays["Scalar field"], [0.5, 0.25])
        np.testing.assert_array_equal(arrays["id"], [7, 8])
        arrays = self.check_points("//X Y Z Rf Gf Bf Intensity Nx Ny Nz\n2\n"
                                   "1 2 3 1 0.5 0 7 0 0 1\n4 5 6 0 0 0 8 0 0 1\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 128, 0], [0, 0, 0]])
        np.testing.assert_array_equal(arrays["intensity"], [7, 8])
        np.testing.assert_array_equal(arrays["Normals"], [[0, 0, 1]] * 2)
        arrays = self.check_points("x,y,z,r,time\n1,2,3,9,1e9\n4,5,6,8,1000000000.001\n")
        np.testing.assert_array_equal(arrays["r"], [9, 8])  # no colour without g and b
        np.testing.assert_array_equal(arrays["time"], [1e9, 1000000000.001])
        self.check_points("# made by me\n1 2 3\n4 5 6\n")

    def test_names_that_come_twice(self):
        arrays = self.check_points("x,y,z,x,Dist,Dist\n1,2,3,7,8,9\n4,5,6,7,8,9\n", path="a.csv")
        self.assertEqual({name: values[0] for name, values in arrays.items()},
                         {"x (column 4)": 7, "Dist": 8, "Dist (column 6)": 9})

    def test_names_of_one_stem(self):
        """As drivers, engines and spreadsheets write them"""
        places, rest = "1,2,3", "10,20,30,0,0,1"
        for names in ("point.x,point.y,point.z,color.r,color.g,color.b,normal.x,normal.y,normal.z",
                      "PosX,PosY,PosZ,ColR,ColG,ColB,NormX,NormY,NormZ",
                      "XCoord,YCoord,ZCoord,R,G,B,nx,ny,nz", "X1 (m),Y1 (m),Z1 (m),R,G,B,nx,ny,nz",
                      "x_m,y_m,z_m,r,g,b,n_x,n_y,n_z",
                      "Points:0,Points:1,Points:2,RGB:0,RGB:1,RGB:2,Normals:0,Normals:1,Normals:2",
                      '"Points_m_XYZ:0","Points_m_XYZ:1","Points_m_XYZ:2",red,green,blue,nx,ny,nz'):
            arrays = self.check_points(f"{names}\n{places},{rest}\n4,5,6,{rest}\n", path="cloud.csv")
            self.assertFalse(self.columns.unsure, names)
            np.testing.assert_array_equal(arrays["RGB"], [[10, 20, 30]] * 2, names)
            np.testing.assert_array_equal(arrays["Normals"], [[0, 0, 1]] * 2, names)
        points, _ = self.read("TIMESTAMP (ns), RANGE (mm), X1 (m), Y1 (m), Z1 (m), X2 (m), Y2 (m), Z2 (m)\n"
                              "9,8,1,2,3,4,5,6\n", path="cloud.csv")
        np.testing.assert_array_equal(points, [[1, 2, 3]])
        # What has three parts is no place for that.
        arrays = self.check_points("vel_x,vel_y,vel_z,x,y,z\n7,8,9,1,2,3\n7,8,9,4,5,6\n", path="cloud.csv")
        self.assertEqual(set(arrays), {"vel_x", "vel_y", "vel_z"})
        self.check_points("a,b,c,vel_x,vel_y,vel_z\n1,2,3,7,8,9\n4,5,6,7,8,9\n", path="cloud.csv")
        self.assertTrue(self.columns.unsure)

    def test_packed_colors(self):
        arrays = self.check_points(f"x y z rgb\n1 2 3 {0xFF8001}\n4 5 6 {0xFF000102}\n")
        np.testing.assert_array_equal(arrays["RGB"], [[255, 128, 1], [0, 1, 2]])
        arrays = self.check_points("x y z rgb\n1 2 3 0.5\n4 5 6 0.25\n")  # whatever that is
        np.testing.assert_array_equal(arrays["rgb"], [0.5, 0.25])

    def test_names_that_say_nothing_of_places(self):
        arrays = self.check_points("u,v,w,value\n1,2,3,4\n4,5,6,7\n")
        np.testing.assert_array_equal(arrays["value"], [4, 7])
        self.assertTrue(self.columns.unsure)
        self.assertIn("u, v, w", str(self.columns))

    def test_tables_of_office_programs(self):
        for text in ("\ufeffx;y;z\n1,0;2,0;3,0\n4;5;6\n", "x\ty\tz\n1,0\t2,0\t3,0\n4\t5\t6\n",
                     '"x","y","z"\n"1","2","3"\n"4","5","6"\n', "x,y,z\n1,2,3,\n4,5,6,\n",
                     "x,y,z,kind\n1,2,3,tree\n4,5,6,a house\n", "1,0 2,0 3,0\n4 5 6\n",
                     "x\ty\tz\n1,0\t2\t3,0\n4\t5\t6\n"):
            self.assertEqual(self.check_points(text, path="cloud.csv"), {}, text)

    def test_marks_of_thousands_and_commas_in_quotes(self):
        """As spreadsheets write them."""
        expected = ((1234.5, -5645023.25, 3), (4, 5, 6.125))
        for text in ("1.234,5;-5.645.023,25;3\n4;5;6,125\n", "1.234,5\t-5.645.023,25\t3\n4\t5\t6,125\n",
                     "1,234.5 -5,645,023.25 3\n4 5 6.125\n", "1,234.5;-5,645,023.25;3\n4;5;6.125\n",
                     '"1,234.5","-5,645,023.25",3\n4,5,6.125\n', '"1.234,5","-5.645.023,25","3"\n4,5,"6,125"\n',
                     '"1234,5","-5645023,25","3"\n"4","5","6,125"\n', '1234,5;"-5645023,25";3\n4;5;"6,125"\n'):
            for names in ("", '"x","y","z"\n' if '",' in text else "x;y;z\n" if ";" in text else "x y z\n"):
                self.check_points(names + text, expected, "a.csv")
        for mark in "'\u2019\u00a0\u202f ":
            big = f"-5{mark}645{mark}023"
            for text in (f"1{mark}234.5;{big}.25;3\n4;5;6.125\n", f"1{mark}234,5\t{big},25\t3\n4\t5\t6,125\n",
                         f'"1{mark}234,5","{big},25","3"\n4,5,"6,125"\n',
                         *([f"1{mark}234.5,{big}.25,3\n4,5,6.125\n"] if mark != " " else [])):
                self.check_points(text, expected, "a.csv")
        self.check_points("100 200 300\n1 2 3\n", ((100, 200, 300), (1, 2, 3)))
        self.check_points("123,456,789.5\n1,2,3\n", ((123, 456, 789.5), (1, 2, 3)))
        self.check_points("123,456,789\n1,2,3\n", ((123, 456, 789), (1, 2, 3)))
        self.check_points('"1,2,3"\n"4,5,6"\n')

    def test_commas_between_and_in_numbers(self):
        """What is a point and what a column cannot be told where some decimals are missing."""
        rows = "0,50,1,55,-2,52\n1,59,-2,51,3,07\n"
        for text in ("x,y,z\n" + rows, "//X,Y,Z\n" + rows, "easting,northing,elevation\n" + rows, rows,
                     "0,50,1,55,-2,52,255,0,7\n1,59,-2,51,3,07,1,2,3\n"):
            with self.assertRaisesRegex(UserProblem, "a.csv: commas seem to be decimal points, and to separate"):
                self.read(text, "a.csv")
        for text in ("1,2,3,10,20,0\n4,5,6,30,0,7\n", "1,2,3.5,10,20,00\n4,5,6,30,00,7\n",
                     "1,2,3,-10,20,07\n4,5,6,30,-10,7\n"):
            self.read(text, "a.csv")

    def test_degrees_without_names(self):
        """Taken as they are, and a line tells it."""
        steps = sphere(500)[0] * [1e-4, 1e-4, 10]
        for middle, is_said in (((50.7, 7.1, 100), True), ((-122.1, 47.5, 10), True), ((0, 0, 0), False),
                                ((356000, 5645000, 100), False)):
            np.savetxt("a.xyz", steps + middle, fmt="%.7f")
            self.read(content_of("a.xyz").decode(), "a.xyz")
            self.assertEqual((self.columns.unsure, "look like latitudes" in str(self.columns)), (is_said, is_said))
        np.savetxt("a.xyz", sphere(500)[0] * [0.1, 0.1, 20] + 5)  # a mast
        self.read(content_of("a.xyz").decode(), "a.xyz")
        self.assertFalse(self.columns.unsure)

    def test_names_in_other_languages(self):
        rows = "7;1,0;2,0;3,0;10;20;30\n8;4,0;5,0;6,0;40;50;60\n"
        for names in ("Punktnummer;Rechtswert;Hochwert;Höhe;Rot;Grün;Blau",
                      "Nr.;Ostwert;Nordwert;Hoehe [m];ROT;GRUEN;BLAU",
                      "Numéro;Est;Nord;Altitude (m);Rouge;Vert;Bleu",
                      "Número;Este;Norte;Elevación;Rojo;Verde;Azul",
                      "Numero;Est;Nord;Quota;Rosso;Verde;Blu"):
            for encoding in ("utf-8", "cp1252", "utf-16"):
                with open("cloud.csv", "w", encoding=encoding) as file:
                    file.write(f"{names}\n{rows}")
                cloud, columns = read_text_cloud("cloud.csv")
                self.assertFalse(columns.unsure, names)
                np.testing.assert_array_equal(places_of(cloud), [[1, 2, 3], [4, 5, 6]], names)
                np.testing.assert_array_equal(arrays_of(cloud)["RGB"], [[10, 20, 30], [40, 50, 60]])

    def test_words_in_the_bytes_of_a_system(self):
        """Beyond the start of the file, too, where the encoding is looked for"""
        rows = 100_000 * b"1,2,3,wood\n"
        with open("cloud.csv", "wb") as file:
            file.write(b"x,y,z,kind\n" + rows + b"4,5,6,b\xe4ume\n")
        self.assertEqual(places_of(read_text_cloud("cloud.csv")[0])[-1].tolist(), [4, 5, 6])

    def test_empty_cells(self):
        for rows in ("1,2,3,,7\n4,5,6,8,\n", "1,2,3,,7\n,,,,\n4,5,6,8,\n,,,,\n"):
            arrays = self.check_points("x,y,z,a,b\n" + rows, path="cloud.csv")
            np.testing.assert_array_equal(arrays["a"], [np.nan, 8], rows)
            np.testing.assert_array_equal(arrays["b"], [7, np.nan], rows)

    def test_cells_without_a_value(self):
        """As programs write them, in the first point as well: the column is no column of words."""
        for word in ("NA", "n/a", "null", "None", "-", '"NA"'):
            arrays = self.check_points(f"x,y,z,r,g,b,t\n1,2,3,{word},{word},{word},{word}\n"
                                       "4,5,6,10,20,30,7\n", path="cloud.csv")
            np.testing.assert_array_equal(arrays["RGB"], [[0, 0, 0], [10, 20, 30]], word)
            np.testing.assert_array_equal(arrays["t"], [np.nan, 7], word)

    def test_tables_without_points(self):
        for path, text in (("a.csv", "x,y,z,r,g,b\n"), ("a.xyz", "# x y z\n"), ("a.pts", "0\n"), ("a.txt", "\n\n")):
            with self.assertRaisesRegex(UserProblem, "holds no points", msg=text):
                self.read(text, path)

    def test_errors_name_the_line(self):
        for row in ("4,5,bad,7", "4,5"):
            with self.assertRaisesRegex(UserProblem, "line 4; complete or delete that line$", msg=row):
                self.read(f"x,y,z,a\n1,2,3,7\n\n{row}\n")
        with self.assertRaisesRegex(UserProblem, "there are too few columns, line 2; complete or delete"):
            self.read("1 2 3 tree 7\n4 5 6\n")

    def test_tables_of_other_names(self):
        """Programs call them .dat, .pnt and the like."""
        points, colors = sphere(2000)
        text = "".join(f"{x} {y} {z} {r} {g} {b}\n" for (x, y, z), (r, g, b) in zip(points, colors))
        for path in ("cloud.dat", "cloud.2024", "cloud"):
            printed = self.info(write(path, "# a scan\n" + text))
            self.assertIn("2000 points", printed)
            self.assertIn("RGB", printed)
        for path, content in (("list.dat", "1 2\n3 4\n"), ("words.dat", "a b c\n"),
                              ("bundle.dat", "# Bundle file v0.3\n2 2\n800 0 0\n1 0 0\n"),
                              ("bytes.dat", b"1 2 3\n\0\0")):
            self.refuse("info", write(path, content), says="unknown extension '.dat'")

    def test_errors_show_what_is_there(self):
        for text, says in (("(1, 2, 3)\n(4, 5, 6)\n", "it begins with '(1, 2, 3)'"),
                           ("x" * 500, "it begins with '" + "x" * 57 + "...'"),
                           ("\n".join(["1 " * 5000] * 3), "3 lines of 5000 numbers; each point needs a line")):
            write("cloud.xyz", text)
            with self.assertRaisesRegex(UserProblem, re.escape(says)):
                read_text_cloud("cloud.xyz")
        _, columns = read_text_cloud(write("cloud.xyz", "1 2 3 4 5 " * 20 + "\n" + "6 7 8 9 0 " * 20))
        self.assertLess(len(str(columns)), 500)
        self.assertIn("70 more", str(columns))

    def test_grid_of_heights(self):
        with self.assertRaisesRegex(UserProblem, "gdal_translate"):
            self.read("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n4 5 6\n")

    def test_tool_names_its_guess(self):
        points, colors = sphere(500)
        gray = colors[:, :1] // 2
        np.savetxt("cloud.xyz", np.column_stack([points, gray, colors]), fmt="%.9g")
        said = self.tool("render", "cloud.xyz", *SMALL, "-o", "out.png")
        self.assertEqual(self.code, 0)
        self.assertIn("x, y, z, intensity, red, green, blue, guessed", said)
        np.savetxt("cloud.xyz", np.column_stack([points, colors]), fmt="%.9g")
        said = self.tool("render", "cloud.xyz", *SMALL, "-o", "out.png", "-v")
        self.assertIn("x, y, z, red, green, blue, guessed", said)

    def test_colors_that_nobody_has_set(self):
        self.assertEqual(self.check_points("1 2 3 0 0 0\n4 5 6 0 0 0\n"), {})

    def test_columns_without_a_meaning(self):
        arrays = self.check_points("1 2 3 900 5\n4 5 6 800 2\n")
        np.testing.assert_array_equal(arrays["column 4"], [900, 800])
        np.testing.assert_array_equal(arrays["column 5"], [5, 2])
        self.assertTrue(self.columns.unsure)
        for count in (8, 10):
            row = " ".join(map(str, range(1, count + 1)))
            self.assertEqual(len(self.check_points(f"{row}\n{row}\n", [[1, 2, 3]] * 2)), count - 3)
        for text, says in (("1 2\n", "has 2 columns of numbers; a point"), ("1,2\n", "2 columns .* between ','"),
                           ("1 2 3 ;\n", "0 columns of numbers between ';'")):
            with self.assertRaisesRegex(UserProblem, says):
                self.read(text)

    def test_colors_beside_columns_of_few_values(self):
        """Alpha or a class before or behind them: these have few values, channels have many."""
        random = np.random.default_rng(1)
        points = random.normal(size=(300, 3))
        colors = random.integers(0, 180, (300, 1)) + random.integers(0, 70, (300, 3))
        for odd in (np.full(300, 255), random.integers(0, 8, 300)):
            for order in ([odd[:, None], colors], [colors, odd[:, None]]):
                np.savetxt("cloud.xyz", np.column_stack([points, *order]), fmt="%.6g")
                cloud, columns = read_text_cloud("cloud.xyz")
                np.testing.assert_array_equal(arrays_of(cloud)["RGB"], colors)
                self.assertTrue(columns.unsure)

    def test_colors_that_may_be_others(self):
        """Intensity, return and class look like colours, and a line tells how they were taken."""
        random = np.random.default_rng(1)
        points, colors = random.normal(size=(300, 3)), random.integers(0, 255, (300, 3))
        for odd, is_unsure in ((colors[:, 1:], False), (colors[:, 1:] // 64, True)):
            np.savetxt("cloud.xyz", np.column_stack([points, colors[:, 0], odd]), fmt="%.6g")
            self.assertEqual(read_text_cloud("cloud.xyz")[1].unsure, is_unsure)

    def test_colors_beside_a_fraction(self):
        """Of which many values differ, as of an intensity in the cloud of a scanner"""
        random = np.random.default_rng(1)
        points, fractions = random.normal(size=(2000, 3)), random.random(2000).round(4)[:, None]
        colors = random.integers(0, 180, (2000, 1)) + random.integers(0, 70, (2000, 3))
        for order in ([fractions, colors], [colors, fractions]):
            np.savetxt("cloud.xyz", np.column_stack([points, *order]), fmt="%.6g")
            cloud, columns = read_text_cloud("cloud.xyz")
            np.testing.assert_array_equal(arrays_of(cloud)["RGB"], colors)
            np.testing.assert_allclose(arrays_of(cloud)["intensity"], fractions[:, 0], atol=1e-6)
            self.assertFalse(columns.unsure)
        for order in ([fractions, colors / 255], [colors / 255, fractions]):  # colours are fractions, too
            np.savetxt("cloud.xyz", np.column_stack([points, *order]), fmt="%.9g")
            cloud, columns = read_text_cloud("cloud.xyz")
            np.testing.assert_array_equal(arrays_of(cloud)["RGB"], colors)
            self.assertTrue(columns.unsure)

    def test_colors_and_normals_among_many_columns(self):
        """As data sets for learning have them, with classes and times behind"""
        random = np.random.default_rng(1)
        points = random.normal(size=(300, 3))
        colors = random.integers(0, 180, (300, 1)) + random.integers(0, 70, (300, 3))
        normals = points / np.linalg.norm(points, axis=1)[:, None]
        times, classes = 1e6 + np.arange(300), random.integers(0, 9, 300)
        for rest, ways in (([colors, times, classes], ("RGB", "column 7", "column 8")),
                           ([classes, classes, colors], ("column 4", "column 5", "RGB")),
                           ([colors, normals, classes], ("RGB", "Normals", "column 10")),
                           ([times, normals, classes, colors, times],
                            ("column 4", "Normals", "column 8", "RGB", "column 12"))):
            np.savetxt("cloud.txt", np.column_stack([points, *rest]), fmt="%.9g")
            cloud, columns = read_text_cloud("cloud.txt")
            arrays = arrays_of(cloud)
            self.assertEqual(set(arrays), set(ways))
            self.assertTrue(columns.unsure)
            np.testing.assert_array_equal(arrays["RGB"], colors)
            if "Normals" in arrays:
                np.testing.assert_allclose(arrays["Normals"], normals, atol=1e-6)

    def test_times_in_front(self):
        """Are taken for places, as places may be sorted, and a line tells it."""
        for first, is_said in ((3e8 + np.arange(20) * 1e-3, True), (np.arange(20) // 2, False)):
            np.savetxt("a.txt", np.column_stack([first, sphere(20)[0]]), fmt="%.9f")
            _, columns = read_text_cloud("a.txt")
            self.assertEqual((columns.unsure, "as times do" in str(columns)), (is_said, is_said))

    def test_numbers_of_points_are_no_places(self):
        """With names that say nothing, and without names"""
        places = [[x, 5, 7] for x in range(12)]
        for head in ("", "No.,a,b,c,value\n"):
            rows = "".join(f"{number},{x},{y},{z},0.5\n" for number, (x, y, z) in enumerate(places, 1))
            arrays = self.check_points(head + rows, places)
            np.testing.assert_array_equal(arrays["value" if head else "intensity"], [0.5] * 12)
        arrays = self.check_points("".join(f"{x} {y} {z}\n" for x, y, z in places), places)
        self.assertEqual(arrays, {})


class TestPtx(ToolCase):
    """Scans of laser scanners. The second one is turned by 90 degrees about z, and moved."""

    AXES = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    FIRST = "1\n3\n" + AXES + "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    SECOND = "2\n1\n" + AXES + "0 1 0 0\n-1 0 0 0\n0 0 1 0\n500000.125 20 30 1\n"

    def read(self, text):
        write("scan.ptx", text)
        cloud, viewpoint, self.missing = read_ptx_cloud("scan.ptx")
        return places_of(cloud), arrays_of(cloud), viewpoint

    def test_two_scans(self):
        points, arrays, viewpoint = self.read(
            self.FIRST + "1 2 3 0.25 9 8 7\n0 0 0 0.5 0 0 0\n4 5 6 0.75 0 0 255\n" + self.SECOND
            + "\n1 2 3 0.5 1 1 1\n0 2 0 1 2 2 2\n")
        np.testing.assert_array_equal(points, [[1, 2, 3], [4, 5, 6], [499998.125, 21, 33],
                                               [499998.125, 20, 30]])
        np.testing.assert_array_equal(arrays["intensity"], [0.25, 0.75, 0.5, 1])
        np.testing.assert_array_equal(arrays["RGB"], [[9, 8, 7], [0, 0, 255], [1] * 3, [2] * 3])
        np.testing.assert_array_equal(arrays["ToScanner"], [[-1, -2, -3], [-4, -5, -6], [2, -1, -3],
                                                            [2, 0, 0]])
        self.assertIsNone(viewpoint)

    def test_scans_of_unknown_places(self):
        """One that a program has converted, and several at the origin, as programs write them that
        have put all points into their places."""
        converted = self.FIRST.replace(self.AXES, 4 * "0 0 0\n")
        arrays = self.read(converted + "1 2 3 0.5\n" + self.SECOND + "1 2 3 0.5\n")[1]
        np.testing.assert_array_equal(arrays["ToScanner"], [[0, 0, 0], [2, -1, -3]])
        arrays = self.read(2 * (self.FIRST + "1 2 3 0.5\n"))[1]
        self.assertEqual(set(arrays), {"intensity"})

    def test_one_scan_has_a_viewpoint(self):
        """And what it lacks at its end is not missed."""
        points, arrays, viewpoint = self.read(self.SECOND + "1 2 3 0.5\n")
        self.assertEqual(self.missing, "its last scan has 1 of the 2 points that its header says")
        self.assertEqual((len(points), set(arrays)), (1, {"intensity", "ToScanner"}))
        self.assertEqual(viewpoint, (500000.125, 20, 30))
        converted = self.FIRST.replace(self.AXES, 4 * "0 0 0\n")  # which no scanner has written
        self.assertIsNone(self.read(converted + "1 2 3 0.5\n")[2])

    def test_z_is_up(self):
        with open("scan.ptx", "w", encoding="utf-8") as file:
            file.write(self.FIRST)
            np.savetxt(file, np.column_stack([sphere(500)[0] * (1, 3, 1) + (9, 0, 0), np.ones(500)]))
        text = self.info("scan.ptx")
        self.assertRegex(text, r"sensor +at 0 0 0\n")
        self.assertRegex(text, r"up +0 0 1\n")

    def test_errors(self):
        for text, says in (("5\n1 2 3 4\n", "scan.ptx is not .*: a scan begins with its columns"),
                           (self.FIRST + "1 2 3 4 5\n1 2 3 4 5\n", "its points have 5 numbers .* line 11$"),
                           (self.FIRST + "1 2 3 bad\n1 2 3 4\n", "'bad', line 11$"),
                           (self.FIRST + "1 2 3 4\n4 5\n", "changed from 4 to 2, line 12$"),
                           (self.FIRST + "0 0 0 0.5\n", "holds no points"),
                           (self.FIRST, "holds no points")):
            with self.assertRaisesRegex(UserProblem, says, msg=text):
                self.read(text)

    def test_files_that_are_cut_short(self):
        """Within a header, a point, or the first number of a point"""
        one = self.FIRST + "1 2 3 0.5\n4 5 6 0.5\n7 8 9 0.5\n"
        for text, where in (("1\n3\n0 0", "line 3, in the header of scan 1"),
                            ("1\n3\n" + self.AXES, "line 6, in the header of scan 1"),
                            (one + self.SECOND[:-6], "line 23, in the header of scan 2"),
                            (self.FIRST + "1 2 3 0.5\n4 5", "line 12, in point 2 of 3 of scan 1"),
                            (self.FIRST + "1 2", "line 11, in point 1 of 3 of scan 1"),
                            (one + self.SECOND + "1 2 3 0.5\n-", "line 25, in point 2 of 2 of scan 2")):
            with self.assertRaises(UserProblem, msg=text) as caught:
                self.read(text)
            self.assertEqual(str(caught.exception), f"scan.ptx is cut short: it ends at {where}; copy or export it "
                             "again")
        self.read(one)
        self.assertEqual(self.missing, "")
        self.assertIn("its last scan has 2 of the 3 points", self.info(write("scan.ptx", one[:-10])))


if __name__ == "__main__":
    unittest.main()
